/// A boot loader's clock and sleep. Timer 0 counts every 128 us in 8 bits; `boot_now` extends the
/// count to 16. Compare times by their difference, which is right up to half of the range, 4 s.
/// Timer 1 counts cycles.
#ifndef BOOTLOADER_AVR_CLOCK_H
#define BOOTLOADER_AVR_CLOCK_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#include "../../kilolib/core/timer.h"
#include "../core/image_store.h"

#define BOOT_COUNTS_OF_MS(ms) ((ms)*CYCLES_PER_MS / COUNT_CYCLES)

/// The time; when the present period began; and the periods that are left until a complete image
/// starts by itself.
extern uint16_t boot_now, boot_period_began, boot_patience;

/// Bit of TIMSK1 for the interrupt TIMER1_COMPB, which ends a sleep: always set.
#define BOOT_WAKES _BV(OCIE1B)

/// Starts both timers.
void boot_clock_init(void);

/// Reads the time. To be called each 32 ms at least. A period is `period` counts.
void boot_clock_keep(uint16_t period);

/// Sleeps until an interrupt, or for so many cycles, up to 65,000. To be called with interrupts
/// off, so that what it waits for cannot come just before; they are on afterwards.
void boot_sleep(uint16_t cycles);

/// Whether a complete image starts by itself: one without a CRC at once, others when boot_patience
/// has come to its end.
bool boot_starts_by_itself(const image_store_t *store);

#endif
