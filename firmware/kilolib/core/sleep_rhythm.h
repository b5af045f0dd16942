/// Rhythm of a sleeping robot (hardware.md 1.3): power-down with everything off, then a look round:
/// the receiver settles, and listens for 10 ms with a white LED. A frame that begins in them keeps
/// the robot awake for 100 ms more, with a red LED. Then down again.
///
/// The functions are for a driver that computes what it would receive; the chip just waits. Times
/// are cycles of 125 ns; pure, constant time.
#ifndef KILOLIB_CORE_SLEEP_RHYTHM_H
#define KILOLIB_CORE_SLEEP_RHYTHM_H

#include <stdbool.h>
#include <stdint.h>

#include "kilolib.h"
#include "timer.h"

#define SLEEP_SETTLE_US 300     ///< of the receiver, after power-down
#define SLEEP_LISTEN_MS 10      ///< with a white LED
#define SLEEP_LISTEN_ON_MS 100  ///< more, with a red one, after a frame's begin

#define SLEEP_LISTEN_COLOR RGB(3, 3, 3)
#define SLEEP_LISTEN_ON_COLOR RGB(3, 0, 0)

/// The watchdog's longest time-out: 2^20 periods of 128 kHz, 8.192 s.
#define SLEEP_DOWN_CYCLES 65536000UL
/// Begin of the listening time, and of the next round, from the begin of a power-down on.
#define SLEEP_LISTEN_FROM (SLEEP_DOWN_CYCLES + SLEEP_SETTLE_US * (CYCLES_PER_MS / 1000))
#define SLEEP_PERIOD_CYCLES (SLEEP_LISTEN_FROM + SLEEP_LISTEN_MS * CYCLES_PER_MS)

/// Whether a frame that begins at `begin` is received by a robot that was sent to sleep at
/// `asleep_since`. `down_since` is the begin of the power-down that looks round are counted from:
/// `asleep_since` at first; a frame in the listening time moves it to the end of the longer stay.
/// Frames have to come in order of time.
static inline bool sleep_rhythm_receives(uint64_t asleep_since, uint64_t *down_since,
                                         uint64_t begin) {
    if (begin < *down_since) return begin >= asleep_since + SLEEP_DOWN_CYCLES;
    const uint64_t since = begin - *down_since;
    const uint64_t phase = since % SLEEP_PERIOD_CYCLES;
    if (phase < SLEEP_DOWN_CYCLES) return false;
    if (phase >= SLEEP_LISTEN_FROM)
        *down_since +=
            since - phase + SLEEP_PERIOD_CYCLES + (uint64_t)SLEEP_LISTEN_ON_MS * CYCLES_PER_MS;
    return true;
}

/// Colour of the LED at `at`, not before `asleep_since` and not before the last frame received.
static inline uint8_t sleep_rhythm_color(uint64_t down_since, uint64_t at) {
    if (at < down_since) return SLEEP_LISTEN_ON_COLOR;
    const uint64_t phase = (at - down_since) % SLEEP_PERIOD_CYCLES;
    return phase >= SLEEP_LISTEN_FROM ? SLEEP_LISTEN_COLOR : 0;
}

#endif
