/// Delays that let time pass as delay() does: interrupts go on meanwhile.
#ifndef KT_UTIL_DELAY_H
#define KT_UTIL_DELAY_H

#include <math.h>

#include "delay_basic.h"

/// A program that defines another clock than the robot's 8 MHz waits too long or too short, as
/// there.
#ifndef F_CPU
#define F_CPU 8000000UL
#endif

static inline __attribute__((unused)) void _delay_ms(double ms) {
    kt_delay((double)(F_CPU) / 1e3 * ms);
}

static inline __attribute__((unused)) void _delay_us(double us) {
    kt_delay((double)(F_CPU) / 1e6 * us);
}

#endif
