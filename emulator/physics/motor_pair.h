/// The two motors of a robot: their duties, which of them turn, and how long they have been on
/// without turning. A motor on legs that stands needs a kick to start: 15 ms at full duty.
#ifndef KILOTWIN_PHYSICS_MOTOR_PAIR_H
#define KILOTWIN_PHYSICS_MOTOR_PAIR_H

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/clock.h"

namespace kilotwin {

/// Arrays hold left, right. Half a cache line: a chassis has the other half.
struct MotorPair {
    std::array<Cycles, 2> since = {0, 0};  ///< when the present duties were set
    Cycles hums_since = NEVER;             ///< on, and neither turns; NEVER: not so
    uint32_t hummed_ms = 0;                ///< how long that was, before hums_since
    std::array<uint8_t, 2> duty = {0, 0};
    std::array<bool, 2> turns = {false, false};  ///< whether the motor turns at this duty

    /// Sets the duties from `at` on, in order of time. `kick_needed`: of motors that need one.
    void set(Cycles at, uint8_t left, uint8_t right, bool kick_needed) {
        set_one(0, at, left, kick_needed);
        set_one(1, at, right, kick_needed);
        if (hums_since != NEVER) hummed_ms += ms_between(hums_since, at);
        const bool hums = (left != 0 || right != 0) && !turns[0] && !turns[1];
        hums_since = hums ? at : NEVER;
    }

    /// Seconds that it was on up to `now` while neither motor turned.
    double hummed_s(Cycles now) const {
        const uint32_t still = hums_since < now ? ms_between(hums_since, now) : 0;
        return (hummed_ms + still) / 1000.0;
    }

  private:
    static constexpr uint8_t LEAST_KICK_DUTY = 200;
    // 15 ms, less what is lost around it.
    static constexpr Cycles KICK_CYCLES = CYCLES_PER_SECOND * 12 / 1000;

    static uint32_t ms_between(Cycles from, Cycles to) {
        return static_cast<uint32_t>((to - from) / (CYCLES_PER_SECOND / 1000));
    }

    // Each motor has a register of its own: on a chip the two change one after the other.
    void set_one(size_t side, Cycles at, uint8_t value, bool kick_needed) {
        if (value == duty[side]) return;
        turns[side] = starts(side, at, value, kick_needed);
        duty[side] = value;
        since[side] = at;
    }

    bool starts(size_t side, Cycles at, uint8_t value, bool kick_needed) const {
        if (value == 0) return false;
        if (!kick_needed || value >= LEAST_KICK_DUTY) return true;
        // It keeps turning unless its kick was too short.
        return turns[side] && (duty[side] < LEAST_KICK_DUTY || at - since[side] >= KICK_CYCLES);
    }
};

}  // namespace kilotwin

#endif
