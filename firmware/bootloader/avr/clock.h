/// A boot loader's time, and its sleep. Timer 0 counts, of 128 us each; here with more bits than it
/// has. Differences of times count, below half of their range: 4 s. Timer 1 counts cycles.
#ifndef BOOTLOADER_AVR_CLOCK_H
#define BOOTLOADER_AVR_CLOCK_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#include "../../kilolib/core/timer.h"
#include "../core/image_store.h"

#define BOOT_COUNTS_OF_MS(ms) ((ms)*CYCLES_PER_MS / COUNT_CYCLES)

/// The time; when the present period began; and whole periods since boot_clock_heard(), which stay
/// at the most that boot_clock_keep() was given.
extern uint16_t boot_now, boot_period_began, boot_periods_in_silence;

/// Bit of TIMSK1 for the interrupt TIMER1_COMPB, which ends a sleep: always set.
#define BOOT_WAKES _BV(OCIE1B)

/// Starts both timers.
void boot_clock_init(void);

/// Reads the time. To be called each 32 ms at least. A period is `period` counts.
void boot_clock_keep(uint16_t period, uint16_t most_periods);

/// A frame has come.
static inline void boot_clock_heard(void) { boot_periods_in_silence = 0; }

/// Sleeps until an interrupt, or for so many cycles, up to 65,000. To be called with interrupts
/// off, so that what it waits for cannot come just before; they are on afterwards.
void boot_sleep(uint16_t cycles);

/// Whether a complete image starts by itself: one without a CRC at once, others if nothing was
/// heard for `patience` periods.
bool boot_starts_by_itself(const image_store_t *store, uint16_t patience);

#endif
