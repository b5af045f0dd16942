/// Delays that let time pass as delay() does: interrupts go on meanwhile.
#ifndef KT_UTIL_DELAY_H
#define KT_UTIL_DELAY_H

#include <math.h>

#include "delay_basic.h"

// F_CPU is defined on the command line, as for the chip. A program that defines another clock waits
// too long or too short, as there.

static inline __attribute__((unused)) void _delay_ms(double ms) {
    kt_delay((double)(F_CPU) / 1e3 * ms);
}

static inline __attribute__((unused)) void _delay_us(double us) {
    kt_delay((double)(F_CPU) / 1e6 * us);
}

#endif
