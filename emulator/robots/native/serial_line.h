/// The serial line that a robot prints on, as kilolib sets it up: 38,400 baud, 8 bits, no parity,
/// one stop bit. A byte takes 10 bits, 260 us; the chip holds one byte, so that a program that
/// polls writes the next when that has left.
///
/// Times are cycles and never go back. All functions take constant time.
#ifndef KILOTWIN_ROBOTS_NATIVE_SERIAL_LINE_H
#define KILOTWIN_ROBOTS_NATIVE_SERIAL_LINE_H

#include <algorithm>
#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

/// 10 bits of 16 * 13 cycles: the divisor of the clock that is nearest to 38,400 baud.
constexpr Cycles SERIAL_BYTE_CYCLES = Cycles{10} * 16 * 13;

/// Characters that wait with NONBLOCKING (debug.h), beside the one that is sent.
constexpr uint32_t SERIAL_QUEUE_BYTES = 127;

class SerialLine {
  public:
    /// When the chip takes the next byte: `now`, or later.
    Cycles ready(Cycles now) const { return std::max(now, free_); }

    /// A program that polls writes `bytes` (above 0), beginning at `now`. Returns when the last is
    /// taken: then it goes on.
    Cycles write(Cycles now, uint32_t bytes) {
        free_ = ready(now) + bytes * SERIAL_BYTE_CYCLES;
        return free_ - SERIAL_BYTE_CYCLES;
    }

    /// `bytes` are to go through the queue at `now`. Returns how many have room; the others are
    /// lost.
    uint32_t queue(Cycles now, uint32_t bytes) {
        const Cycles busy = ready(now) - now;
        const auto held =
            static_cast<uint32_t>((busy + SERIAL_BYTE_CYCLES - 1) / SERIAL_BYTE_CYCLES);
        const uint32_t room = SERIAL_QUEUE_BYTES + 1 - std::min(held, SERIAL_QUEUE_BYTES + 1);
        const uint32_t taken = std::min(bytes, room);
        free_ = ready(now) + taken * SERIAL_BYTE_CYCLES;
        return taken;
    }

  private:
    Cycles free_ = 0;  ///< when the last byte will have left
};

}  // namespace kilotwin

#endif
