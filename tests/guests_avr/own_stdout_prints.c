// A program may have its own stdout: a function for single characters.
#include <avr/io.h>
#include <stdio.h>
#include <string.h>

#include "check.h"

static char printed[64];
static uint8_t length;

static int keep(char character, FILE *stream) {
    (void)stream;
    if (length < sizeof printed - 1) printed[length++] = character;
    return 0;
}

static int give(FILE *stream) {
    (void)stream;
    static uint8_t given;
    return given < 3 ? "ab\n"[given++] : _FDEV_EOF;
}

static FILE mine = FDEV_SETUP_STREAM(keep, NULL, _FDEV_SETUP_WRITE);
static FILE other;

static int was_printed(const char *text) {
    const int same = strcmp(printed, text) == 0;
    memset(printed, 0, sizeof printed);
    length = 0;
    return same;
}

static void check(void) {
    FILE *const before = stdout;
    stdout = &mine;
    printf("uid %u, %s\n", kilo_uid - kilo_uid, "well");
    putchar('!');
    puts("");
    stdout = before;
    CHECK(was_printed("uid 0, well\n!\n"));

    fprintf(&mine, "%ld %lu %02x", -2L, 4000000000UL, 10u);
    CHECK(was_printed("-2 4000000000 0a"));

    char line[8];
    fdev_setup_stream(&other, keep, give, _FDEV_SETUP_RW);
    fputs("x", &other);
    CHECK(was_printed("x"));
    CHECK(fgets(line, sizeof line, &other) != NULL && strcmp(line, "ab\n") == 0);
    CHECK(fgetc(&other) == EOF);
}
