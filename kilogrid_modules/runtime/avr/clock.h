/// Timer 0: ticks, the cells' turns to send, the receiver's way from cell to cell.
#ifndef MODULE_AVR_CLOCK_H
#define MODULE_AVR_CLOCK_H

#include <stdint.h>

void runtime_clock_init(void);
void runtime_clock_stop(void);

/// Since runtime_clock_init(), in seconds; stays at 65,535.
uint16_t runtime_clock_uptime(void);

#endif
