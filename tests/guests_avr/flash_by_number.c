// Flash at an address of the program's own choice, which its linker script may define, reads as
// erased here; and what the robot's compiler defines is defined.
#include <avr/common.h>
#include <avr/fuse.h>
#include <avr/lock.h>
#include <avr/pgmspace.h>
#include <avr/signature.h>
#include <unistd.h>

#include "check.h"

#if !defined(__AVR__) || !defined(AVR) || !defined(__AVR_ATmega328P__) || F_CPU != 8000000UL
#error "this is no robot"
#endif

FUSES = {.low = LFUSE_DEFAULT, .high = HFUSE_DEFAULT, .extended = EFUSE_DEFAULT};
LOCKBITS = LB_MODE_1;

#define TABLE_AT 0x2001

static const uint16_t words[] PROGMEM = {1, 500};
static const char *const names[] PROGMEM = {"a", "b"};

static void check(void) {
    for (uint16_t i = 0; i < 3; i++)
        CHECK(pgm_read_word(TABLE_AT + sizeof(words[0]) * i) == 0xFFFF);
    CHECK(pgm_read_byte(TABLE_AT) == 0xFF);
    CHECK(pgm_read_word(&words[1]) == 500);
    CHECK(*(const char *)pgm_read_word(&names[1]) == 'b');
    CHECK(__signature[2] == 0x1E && __signature[0] == 0x0F);
}
