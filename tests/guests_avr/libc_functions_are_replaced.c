// A program may have functions of its own with libc's names, and uses libc's without a header.
#include "check.h"

static int put, drawn;

int putchar(int character) {
    put++;
    return character;
}
int rand(void) { return drawn++; }
int fputs(const char *text, FILE *stream) {
    (void)text;
    (void)stream;
    return 7;
}

static void check(void) {
    char text[20];
    putchar('a');
    CHECK(put == 1);
    CHECK(rand() == 0 && rand() == 1);
    CHECK(fputs("x", stdout) == 7);
    CHECK(sprintf(text, "%ld", (int32_t)-70000) == 6);
    CHECK(time(NULL) == 0);  // the robot's clock, not the PC's
    CHECK(strtol("12", NULL, 10) == 12);
}
