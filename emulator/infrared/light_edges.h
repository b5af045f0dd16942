/// Light on a receiver, as pulses that begin and end: whether any is on, and how strong it is.
#ifndef KILOTWIN_INFRARED_LIGHT_EDGES_H
#define KILOTWIN_INFRARED_LIGHT_EDGES_H

#include <algorithm>
#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

#include "base/clock.h"
#include "kilolib.h"

namespace kilotwin {

/// Light on a receiver from `begin` to before `end`. `strength` is what the converter makes of it.
struct LightPulse {
    Cycles begin, end;
    distance_measurement_t strength;
};

/// Times are the board's own cycles. Pulses may overlap: the light then lasts until the last of
/// them ends, and their strengths add up.
class LightEdges {
  public:
    static constexpr uint64_t NONE = UINT64_MAX;

    /// A pulse, not before what has been passed. It lasts a cycle at least.
    void add(uint64_t begin, uint64_t end, distance_measurement_t strength) {
        edges_.push({begin, true, strength});
        edges_.push({std::max(end, begin + 1), false, strength});
    }

    /// When the light next goes on or off, or changes its strength.
    uint64_t next() const { return edges_.empty() ? NONE : edges_.top().cycle; }

    /// Goes through what is due. At one moment what begins comes before what ends, so light that is
    /// passed on from one pulse to the next does not flicker.
    void pass(uint64_t now) {
        while (next() <= now) {
            const Edge &edge = edges_.top();
            const int32_t sign = edge.on ? 1 : -1;
            count_ += sign;
            low_ += sign * edge.strength.low_gain;
            high_ += sign * edge.strength.high_gain;
            edges_.pop();
        }
    }

    /// Whether any light is on, and the readings of both amplifiers, 0..1023.
    bool lit() const { return count_ > 0; }
    int16_t low() const { return reading(low_); }
    int16_t high() const { return reading(high_); }

  private:
    struct Edge {
        uint64_t cycle;
        bool on;
        distance_measurement_t strength;
        bool operator>(const Edge &other) const {
            return cycle != other.cycle ? cycle > other.cycle : on < other.on;
        }
    };

    static int16_t reading(int32_t strength) {
        constexpr int32_t MOST = 1023;
        return static_cast<int16_t>(std::min(strength, MOST));
    }

    std::priority_queue<Edge, std::vector<Edge>, std::greater<>> edges_;
    int32_t count_ = 0, low_ = 0, high_ = 0;  ///< of the pulses that are on: number, strengths
};

}  // namespace kilotwin

#endif
