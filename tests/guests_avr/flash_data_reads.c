// PROGMEM: tables of all widths, tables of texts, and the *_P functions.
#include <avr/pgmspace.h>
#include <string.h>

#include "check.h"

static const uint8_t BYTES[] PROGMEM = {1, 2, 250};
static const uint16_t WORDS[] PROGMEM = {1, 60000};
static const uint32_t LONGS[] PROGMEM = {1, 4000000000};
static const float FLOATS[] PROGMEM = {0.5f, -3.0f};
static const double DOUBLES[] PROGMEM = {0.5, -3.0};
static const char FIRST[] PROGMEM = "first";
static const char SECOND[] PROGMEM = "second";
static const __flash char NAMED[] = "named";
static PGM_P const TEXTS[] PROGMEM = {FIRST, SECOND};

static void check(void) {
    char text[16];
    CHECK(pgm_read_byte(&BYTES[2]) == 250);
    CHECK(pgm_read_byte(FIRST + 1) == 'i');
    CHECK(pgm_read_word(&WORDS[1]) == 60000);
    CHECK(pgm_read_dword(&LONGS[1]) == 4000000000);
    CHECK(pgm_read_float(&FLOATS[1]) == -3);
    CHECK(pgm_read_float(&DOUBLES[1]) == -3);

    strcpy_P(text, (PGM_P)pgm_read_word(&TEXTS[1]));
    CHECK(strcmp(text, "second") == 0);
    strcpy_P(text, (PGM_P)pgm_read_ptr(&TEXTS[0]));
    CHECK(strcmp_P(text, PSTR("first")) == 0);
    CHECK(strlen_P(FIRST) == 5);
    const __flash char *named = NAMED;
    CHECK(named[4] == 'd');
    memcpy_P(text, BYTES, sizeof BYTES);
    CHECK(text[1] == 2);
    printf_P(PSTR("printed from %s\n"), "flash");
}
