/// Driver of timer 0: ticks, turns of the cells and dwells of the receiver (core/turns.h).
#ifndef MODULE_AVR_CLOCK_H
#define MODULE_AVR_CLOCK_H

#include <stdint.h>

/// Starts the timer with tick 0. Its interrupts count module_ticks, send by infrared (4.4 ms with
/// interrupts off) and switch the receiver.
void runtime_clock_init(void);

/// Disables the timer's interrupts, for the boot loader.
void runtime_clock_stop(void);

/// Seconds since runtime_clock_init(); stays at 65,535.
uint16_t runtime_clock_uptime(void);

#endif
