/// Timer 0: the ticks, and when a message may be sent (hardware.md 1.6).
#ifndef KILOLIB_AVR_CLOCK_H
#define KILOLIB_AVR_CLOCK_H

/// Sets kilo_ticks to 0 and starts the timer. The first tick comes 32.768 ms later.
void kilolib_clock_init(void);

/// No more ticks.
void kilolib_clock_stop(void);

#endif
