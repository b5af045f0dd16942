// A program in the boot section that calls a function below it, puts another one in its place,
// calls it again, and so on. Each function shows a colour of its own and adds to a sum.
#include <avr/boot.h>
#include <avr/io.h>
#include <avr/pgmspace.h>

#define PLACE 0x1000u
#define FIRST 0x2000u
#define SECOND 0x2800u

volatile uint16_t sum, turns;

// Position-independent, and a page at most each.
#define FUNCTION(name, where, amount, port)                       \
    __attribute__((section(where), noinline)) void name(void) {   \
        for (uint8_t i = 0; i < (amount); i++) sum = sum * 5 + i; \
        PORTD = (port);                                           \
    }

FUNCTION(called, ".place", 3, 1 << 4)
FUNCTION(first, ".first", 3, 1 << 4)
FUNCTION(second, ".second", 40, 1 << 5)

static void finish(void) {
    while (boot_spm_busy()) {
    }
    boot_rww_enable();
}

static void copy_page(uint16_t from) {
    boot_page_erase(PLACE);
    finish();
    for (uint16_t at = 0; at < SPM_PAGESIZE; at += 2)
        boot_page_fill(PLACE + at, pgm_read_word(from + at));
    boot_page_write(PLACE);
    finish();
}

int main(void) {
    DDRD = 1 << 4 | 1 << 5;
    for (;;) {
        for (uint8_t i = 0; i < 20; i++) called();
        copy_page(turns++ % 3 == 0 ? FIRST : SECOND);
        // Addresses of the two that are only copied from, so that they stay in the image.
        if (turns == 0) first(), second();
    }
}
