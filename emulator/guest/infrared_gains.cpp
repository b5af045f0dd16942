#include "guest/infrared_gains.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

namespace {

constexpr int CONVERTER_MOST = 1023;
constexpr double HIGH_OVER_LOW = 5;
constexpr double LOW_AT_CONTACT = 900;
// exp(-5 mm / 25 mm): from one entry to the next.
constexpr double FALL = 0.8187307530779818;
// A whole number of millimetres stays one, as in the robot's own arithmetic.
constexpr double ROUNDING = 1e-9;
constexpr double HIGH_ONLY_BELOW = 700, LOW_ONLY_ABOVE = 900;

using Table = std::array<uint16_t, InfraredGains::ENTRIES>;

/// FALL to the power of 0, 1, 2 ...; what is left after the last is no light at all.
constexpr auto FALLEN = [] {
    std::array<double, 64> powers{};
    double value = 1;
    for (double &power : powers) {
        power = value;
        value *= FALL;
    }
    return powers;
}();

// Not limited to the converter's range, so that it can go on falling beyond the table.
double signal(double at_contact, double distance_mm) {
    const double entries =
        std::max((distance_mm - InfraredGains::FIRST_MM) / InfraredGains::SPACING_MM, 0.0);
    const auto whole = static_cast<size_t>(entries);
    if (whole >= FALLEN.size()) return 0;
    return at_contact * FALLEN[whole] * (1 - (entries - static_cast<double>(whole)) * (1 - FALL));
}

int16_t converted(double value) {
    return static_cast<int16_t>(std::clamp(std::floor(value + 0.5), 0.0, double(CONVERTER_MOST)));
}

// Linear between entries and, with the slope of the last two, beyond them.
double distance_of(const Table &table, double gain) {
    size_t i = 1;
    while (i + 1 < table.size() && gain < table[i]) i++;
    double fall = std::max(double(table[i - 1]) - table[i], 1.0);
    return InfraredGains::FIRST_MM +
           InfraredGains::SPACING_MM * (static_cast<double>(i - 1) + (table[i - 1] - gain) / fall);
}

}  // namespace

InfraredGains::InfraredGains(double sensitivity) {
    for (size_t i = 0; i < ENTRIES; i++) {
        double low =
            signal(LOW_AT_CONTACT * sensitivity, FIRST_MM + SPACING_MM * static_cast<double>(i));
        low_[i] = static_cast<uint16_t>(converted(low));
        high_[i] = static_cast<uint16_t>(converted(low * HIGH_OVER_LOW));
    }
}

distance_measurement_t InfraredGains::measure(double distance_mm, double low_noise_lsb,
                                              double high_noise_lsb) const {
    double low = signal(low_[0], distance_mm);
    return {converted(low + low_noise_lsb), converted(low * HIGH_OVER_LOW + high_noise_lsb)};
}

uint8_t InfraredGains::estimate_mm(distance_measurement_t measured) const {
    double high = measured.high_gain, low = measured.low_gain;
    double high_share =
        std::clamp((LOW_ONLY_ABOVE - high) / (LOW_ONLY_ABOVE - HIGH_ONLY_BELOW), 0.0, 1.0);
    double distance = 0;
    if (high_share > 0) distance += high_share * distance_of(high_, high);
    if (high_share < 1) distance += (1 - high_share) * distance_of(low_, low);
    return static_cast<uint8_t>(std::clamp(distance + ROUNDING, FIRST_MM, 255.0));
}

}  // namespace kilotwin
