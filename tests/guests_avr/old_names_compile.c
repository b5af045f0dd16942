// Headers and macros of old programs.
#include <avr/boot.h>
#include <avr/delay.h>
#include <avr/signal.h>
#include <avr/version.h>
#include <compat/deprecated.h>
#include <util/twi.h>

#include "check.h"

static void check(void) {
    outb(GPIOR1, 0);
    sbi(GPIOR1, 3);
    CHECK(inb(GPIOR1) == 8);
    cbi(GPIOR1, 3);
    CHECK(inp(GPIOR1) == 0);
    CHECK(boot_signature_byte_get(2) == 0x95);
    CHECK(TW_START == 0x08 && TW_READ == 1);
    _delay_us(10);
}
