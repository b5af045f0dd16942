// itoa() and the rest of what avr-libc has beyond the standard.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

static char text[40];

static int is(const char *expected) { return strcmp(text, expected) == 0; }

static void check(void) {
    CHECK(itoa(-123, text, 10) == text && is("-123"));
    itoa(-1, text, 16);
    CHECK(is("ffff"));
    itoa(10, text, 2);
    CHECK(is("1010"));
    utoa(65535, text, 10);
    CHECK(is("65535"));
    ltoa(-2000000000, text, 10);
    CHECK(is("-2000000000"));
    ultoa(4000000000, text, 36);
    CHECK(is("1u5hvr4"));

    dtostrf(3.14159, 8, 3, text);
    CHECK(is("   3.142"));
    dtostrf(-2.5, -6, 1, text);
    CHECK(is("-2.5  "));

    CHECK(strlcpy(text, "abcdef", 4) == 6 && is("abc"));
    CHECK(strlcat(text, "def", 6) == 6 && is("abcde"));
    CHECK(strcmp(strrev(text), "edcba") == 0);
    CHECK(strcmp(strupr(text), "EDCBA") == 0);
    CHECK(strcmp(strlwr(text), "edcba") == 0);
    strcpy(text, "left,right");
    CHECK(strcmp(strtok(text, ","), "left") == 0 && strcmp(strtok(NULL, ","), "right") == 0);

    char *copy = strdup("copy");
    CHECK(copy != NULL && strcmp(copy, "copy") == 0);
    free(copy);
    CHECK(atoi("-17") == -17 && strtoul("ff", NULL, 16) == 255);

    CHECK(square(3) == 9);
    CHECK(fabs(sin(M_PI / 6) - 0.5) < 1e-6 && lround(2.5) == 3);
    CHECK(isnan(NAN) && !isnan(1.0) && isinf(INFINITY));

    srand(1);
    CHECK(rand() == 16807);
    CHECK(RAND_MAX == 0x7FFF && RANDOM_MAX == 0x7FFFFFFF);
}
