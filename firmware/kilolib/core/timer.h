/// Timer 0 of robots and Kilogrid modules, which makes their ticks (hardware.md 1.6).
///
/// It counts units of 128 us, from 0 to 255 and over again. A tick is a match with 255; a failed
/// attempt to send moves the compare value, and that match comes on top.
#ifndef KILOLIB_CORE_TIMER_H
#define KILOLIB_CORE_TIMER_H

#define CYCLES_PER_MS 8000UL  ///< of 125 ns
#define COUNT_CYCLES 1024     ///< cycles of 125 ns in a count
#define TICK_COUNTS 256       ///< counts from tick to tick: 32.768 ms
#define TICK_MATCH 255        ///< compare value of an ordinary tick

#endif
