// Tables with negative numbers in flash: what is read of them is assigned to a variable, as it is.
#include <avr/pgmspace.h>

#include "check.h"

static const int INTS[] PROGMEM = {10, -20, 32767, -32768};
static const int16_t SHORTS[] PROGMEM = {-1, 300, -300};
static const long LONGS[] PROGMEM = {-70000, 70000};
static const int32_t WIDE[][2] PROGMEM = {{1, 2}, {3, -2147483647}};
static const unsigned UNSIGNED[] PROGMEM = {65516, 20};
static const int8_t BYTES[] PROGMEM = {-20, 20};
static const char CHARS[] PROGMEM = {-20, 20};
static const struct {
    uint8_t kind;
    int16_t gain;
} ROWS[] PROGMEM = {{1, -5}, {2, 5}};
static volatile uint8_t one = 1;

static int of_flash(const int *at) { return pgm_read_word(at); }

static void check(void) {
    int number = pgm_read_word(&INTS[one]);
    int wide = pgm_read_word(INTS + 3 * one);
    int16_t narrow = pgm_read_word(&SHORTS[2 * one]);
    long large = pgm_read_dword(&LONGS[0]);
    int32_t row = pgm_read_dword(&WIDE[one][1]);
    CHECK(number == -20);
    CHECK((int)pgm_read_word(&INTS[one]) < 0);
    CHECK(wide + 32767 == -1);
    CHECK(narrow == -300);
    CHECK(large == -70000);
    CHECK(row == -2147483647);
    CHECK(of_flash(&INTS[one]) == -20);
    CHECK(of_flash(INTS) == 10);
    number = pgm_read_word(&ROWS[0].gain);
    CHECK(number == -5);
    number = pgm_read_word_near(SHORTS);
    CHECK(number == -1);

    // Without a sign, as they are: words of tables without one, and all bytes, since int is wider.
    CHECK(pgm_read_word(&UNSIGNED[0]) == 65516);
    int byte = pgm_read_byte(&BYTES[0]);
    CHECK(byte == 236);
    byte = pgm_read_byte(&CHARS[0]);
    CHECK(byte == 236);
    int8_t again = pgm_read_byte(&BYTES[0]);
    CHECK(again == -20);
}
