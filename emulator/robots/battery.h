/// The battery of a robot: what get_voltage() reads of it.
#pragma once

#include <algorithm>

#include "base/clock.h"

namespace kilotwin {

/// Converter reading of a battery, 580 (empty) to 720 (full): as hardware.md 1.3 has it, above 682
/// is green and 614 or less red.
///
/// It falls evenly with the charge used, from full at power-up; a robot at rest uses a tenth of
/// what a driving one needs (a guess: nothing is published on it). `driven` and `age` are the time
/// with a motor on and the time since power-up; `lasts` is how long it drives on a full battery, 0
/// for ever.
inline int16_t battery_reading(Cycles driven, Cycles age, Cycles lasts) {
    constexpr double FULL = 720, EMPTY = 580, AT_REST = 0.1;
    if (lasts == 0) return static_cast<int16_t>(FULL);
    const double used =
        (static_cast<double>(driven) * (1 - AT_REST) + static_cast<double>(age) * AT_REST) /
        static_cast<double>(lasts);
    return static_cast<int16_t>(std::max(FULL - (FULL - EMPTY) * used, EMPTY));
}

}  // namespace kilotwin
