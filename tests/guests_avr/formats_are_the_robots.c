// printf() and its kin with what robots print: int32_t as %ld, floats, and text from flash.
#include <avr/pgmspace.h>
#include <stdio.h>
#include <string.h>

#include "check.h"

static char text[64];
static volatile size_t room = 4;
static char flash_format[] = "%S-%c-%u";  // a PC takes %S for something else

static int is(const char *expected) { return strcmp(text, expected) == 0; }

static void check(void) {
    const int32_t below_zero = -70000;
    const uint32_t large = 4000000000;
    sprintf(text, "%ld %lu %lx|%6ld|%-8lu|", (long)below_zero, (unsigned long)large,
            (unsigned long)large, (long)below_zero, (unsigned long)large);
    CHECK(is("-70000 4000000000 ee6b2800|-70000|4000000000|"));

    sprintf(text, "%.2f %5.1f %d%%", 1.5, -0.25, 7);
    CHECK(is("1.50  -0.2 7%"));
    CHECK(snprintf(text, room, "%s", "abcdef") == 6 && is("abc"));
    sprintf_P(text, flash_format, PSTR("flash"), 'x', 65535u);
    CHECK(is("flash-x-65535"));
}
