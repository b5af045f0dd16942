/// The watchdog, which a Kilobot uses as an alarm clock. Interrupts have to be off for both: the
/// second write counts only within four cycles of the first.
#ifndef KILOLIB_AVR_WATCHDOG_H
#define KILOLIB_AVR_WATCHDOG_H

#include "board.h"

/// Off. At the start of every program: after a reset by it it would ring again at once.
static inline void watchdog_stop(void) {
    __asm__ volatile("wdr");
    // It has to be down, or a reset by the watchdog keeps it running.
    MCUSR &= (uint8_t)~BIT(WDRF);
    WDTCSR = BIT(WDCE) | BIT(WDE);
    WDTCSR = 0;
}

/// An interrupt each 8 s, and no reset.
static inline void watchdog_ring_in_8_s(void) {
    __asm__ volatile("wdr");
    WDTCSR = BIT(WDCE) | BIT(WDE);
    WDTCSR = BIT(WDIE) | BIT(WDP3) | BIT(WDP0);
}

#endif
