// What a program prints goes to the run folder; nothing reaches the emulator's own output.
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "side.h"

enum { LINE_BYTES = 512 };

void debug_init(void);
void debug_init(void) {}

int vprintf(const char *format, va_list arguments) {
    char line[LINE_BYTES];
    int length = vsnprintf(line, sizeof line, format, arguments);
    if (length > 0) kt_print(line, length < LINE_BYTES ? (uint32_t)length : LINE_BYTES - 1);
    return length;
}

int printf(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vprintf(format, arguments);
    va_end(arguments);
    return length;
}

int vfprintf(FILE *stream, const char *format, va_list arguments) {
    (void)stream;
    return vprintf(format, arguments);
}

int fprintf(FILE *stream, const char *format, ...) {
    (void)stream;
    va_list arguments;
    va_start(arguments, format);
    int length = vprintf(format, arguments);
    va_end(arguments);
    return length;
}

int puts(const char *text) {
    kt_print(text, (uint32_t)strlen(text));
    kt_print("\n", 1);
    return 1;
}

int fputs(const char *text, FILE *stream) {
    (void)stream;
    kt_print(text, (uint32_t)strlen(text));
    return 1;
}

int putchar(int character) {
    char byte = (char)character;
    kt_print(&byte, 1);
    return character;
}

int fputc(int character, FILE *stream) {
    (void)stream;
    return putchar(character);
}

int putc(int character, FILE *stream) {
    (void)stream;
    return putchar(character);
}

size_t fwrite(const void *data, size_t size, size_t count, FILE *stream) {
    (void)stream;
    kt_print(data, (uint32_t)(size * count));
    return count;
}

int fflush(FILE *stream) {
    (void)stream;
    return 0;
}
