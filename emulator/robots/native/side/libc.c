// Functions of avr-libc that the PC's libc lacks, or has with a state that robots must not share.
// Weak: a program may define functions of the same names.
#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "kt_avr.h"

#define WEAK __attribute__((weak))

WEAK char *strrev(char *text) {
    const size_t length = strlen(text);
    for (size_t i = 0; i < length / 2; i++) {
        const char swapped = text[i];
        text[i] = text[length - 1 - i];
        text[length - 1 - i] = swapped;
    }
    return text;
}

WEAK char *strlwr(char *text) {
    for (char *c = text; *c != '\0'; c++) *c = (char)tolower((unsigned char)*c);
    return text;
}

WEAK char *strupr(char *text) {
    for (char *c = text; *c != '\0'; c++) *c = (char)toupper((unsigned char)*c);
    return text;
}

WEAK size_t strlcpy(char *to, const char *from, size_t bytes) {
    const size_t length = strlen(from);
    if (bytes == 0) return length;
    const size_t copied = length < bytes ? length : bytes - 1;
    memcpy(to, from, copied);
    to[copied] = '\0';
    return length;
}

WEAK size_t strlcat(char *to, const char *from, size_t bytes) {
    const size_t used = strnlen(to, bytes);
    return used + strlcpy(to + used, from, bytes - used);
}

WEAK char *strtok(char *text, const char *stop) {
    static char *rest;
    return strtok_r(text, stop, &rest);
}

// avr-libc's conversion; the text is empty for other bases.
static char *digits(uint32_t number, char *text, int base) {
    char *end = text;
    if (base >= 2 && base <= 36) {
        do {
            *end++ = "0123456789abcdefghijklmnopqrstuvwxyz"[number % (uint32_t)base];
            number /= (uint32_t)base;
        } while (number > 0);
    }
    *end = '\0';
    return strrev(text);
}

static char *signed_digits(int32_t number, uint32_t bits, char *text, int base) {
    if (base != 10) return digits((uint32_t)number & bits, text, base);
    if (number >= 0) return digits((uint32_t)number, text, base);
    *text = '-';
    digits(0u - (uint32_t)number, text + 1, base);
    return text;
}

// A negative int in another base shows the robot's 16 bits; values that an int there cannot hold
// show 32.
WEAK char *itoa(int number, char *text, int base) {
    const uint32_t bits = number < 0 && number >= INT16_MIN ? UINT16_MAX : UINT32_MAX;
    return signed_digits(number, bits, text, base);
}

WEAK char *ltoa(long number, char *text, int base) {
    return signed_digits((int32_t)number, UINT32_MAX, text, base);
}

WEAK char *utoa(unsigned int number, char *text, int base) { return digits(number, text, base); }

WEAK char *ultoa(unsigned long number, char *text, int base) {
    return digits((uint32_t)number, text, base);
}

WEAK char *dtostrf(double number, signed char width, unsigned char digits_after, char *text) {
    sprintf(text, "%*.*f", width, digits_after, number);
    return text;
}

// The format is "%.*e", or with a flag "% .*e" or "%+.*e".
WEAK char *dtostre(double number, char *text, unsigned char digits_after, unsigned char flags) {
    char format[] = "%+.*e";
    char *start = format;
    if (flags & DTOSTR_ALWAYS_SIGN) format[1] = ' ';
    if (flags & DTOSTR_PLUS_SIGN) format[1] = '+';
    if (!(flags & (DTOSTR_ALWAYS_SIGN | DTOSTR_PLUS_SIGN))) *++start = '%';
    sprintf(text, start, digits_after, number);
    return flags & DTOSTR_UPPERCASE ? strupr(text) : text;
}

// As random() in stdlib.c.
WEAK long random_r(unsigned long *state) {
    if (*state == 0) *state = 123459876;
    *state = *state * 16807 % 2147483647;
    return (long)*state;
}

WEAK double square(double x) { return x * x; }
WEAK float squaref(float x) { return x * x; }

// The PC's is one per thread, not per robot.
WEAK int errno;

// Moved by the program alone, as in avr-libc.
static time_t system_time;

WEAK time_t time(time_t *now) {
    if (now != NULL) *now = system_time;
    return system_time;
}

WEAK void set_system_time(time_t now) { system_time = now; }
WEAK void system_tick(void) { system_time++; }
WEAK int32_t difftime(time_t end, time_t begin) { return (int32_t)(end - begin); }

// Longer delays than 32 bits of cycles (9 minutes) are split.
#define CYCLES_AT_ONCE 0x40000000u

void kt_delay(double cycles) {
    if (cycles < 0) cycles = -cycles;
    for (; cycles > CYCLES_AT_ONCE; cycles -= CYCLES_AT_ONCE) kt_wait(CYCLES_AT_ONCE);
    const uint32_t whole = (uint32_t)cycles;
    if (cycles > 0) kt_wait(cycles > whole ? whole + 1 : whole);
}
