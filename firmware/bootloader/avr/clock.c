#include "clock.h"

uint16_t boot_now, boot_period_began, boot_patience;

// The sleep mode is idle, in which all parts go on.
void boot_clock_init(void) {
    TCCR0B = _BV(CS02) | _BV(CS00);
    TCCR1B = _BV(CS10);
    TIMSK1 = BOOT_WAKES;
    SMCR = _BV(SE);
}

void boot_clock_keep(uint16_t period) {
    boot_now = (uint16_t)(boot_now + (uint8_t)(TCNT0 - (uint8_t)boot_now));
    if ((uint16_t)(boot_now - boot_period_began) < period) return;
    boot_period_began = (uint16_t)(boot_period_began + period);
    if (boot_patience != 0) boot_patience--;
}

// An interrupt that waits already is let in behind the instruction that follows sei.
void boot_sleep(uint16_t cycles) {
    OCR1B = (uint16_t)(TCNT1 + cycles);
    __asm__ volatile("sei \n"
                     "sleep" ::
                         : "memory");
}

bool boot_starts_by_itself(const image_store_t *store) {
    return store->state == STORE_COMPLETE && (!store->image.checked || boot_patience == 0);
}
