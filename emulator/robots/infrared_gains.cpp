#include "robots/infrared_gains.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <mutex>
#include <string_view>
#include <unordered_set>

namespace kilotwin {

namespace {

constexpr double HIGH_OVER_LOW = 5;
constexpr double LOW_AT_CONTACT = 900;
// exp(-5 mm / 25 mm): from one entry to the next.
constexpr double FALL = 0.8187307530779818;

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
    const double entries = std::max((distance_mm - GAIN_CONTACT_MM) / GAIN_SPACING_MM, 0.0);
    const auto whole = static_cast<size_t>(entries);
    if (whole >= FALLEN.size()) return 0;
    return at_contact * FALLEN[whole] * (1 - (entries - static_cast<double>(whole)) * (1 - FALL));
}

// Linear between entries; beyond the last one it falls as a synthetic one does.
double measured_signal(const uint16_t *table, double distance_mm) {
    constexpr double LAST = GAIN_ENTRIES - 1;
    const double entries = std::max((distance_mm - GAIN_CONTACT_MM) / GAIN_SPACING_MM, 0.0);
    if (entries >= LAST)
        return signal(table[GAIN_ENTRIES - 1], distance_mm - LAST * GAIN_SPACING_MM);
    const auto whole = static_cast<size_t>(entries);
    const double part = entries - static_cast<double>(whole);
    return table[whole] * (1 - part) + table[whole + 1] * part;
}

int16_t converted(double value) {
    return static_cast<int16_t>(std::clamp(value + 0.5, 0.0, double(CONVERTER_MOST)));
}

}  // namespace

bool InfraredGains::Tables::operator==(const Tables &other) const {
    return measured == other.measured && std::memcmp(&entries, &other.entries, sizeof entries) == 0;
}

size_t InfraredGains::Hash::operator()(const Tables &tables) const {
    static_assert(sizeof tables.entries == sizeof(uint16_t) * 2 * GAIN_ENTRIES);
    return std::hash<std::string_view>()(
        {reinterpret_cast<const char *>(&tables.entries), sizeof tables.entries});
}

// Kept for each robot they would be a line of the cache more.
const InfraredGains::Tables &InfraredGains::shared(const Tables &tables) {
    static std::unordered_set<Tables, Hash> all;
    static std::mutex guard;
    const std::lock_guard<std::mutex> lock(guard);
    return *all.insert(tables).first;
}

InfraredGains::InfraredGains(const gain_tables_t &measured) : tables_(&shared({measured, true})) {}

InfraredGains::InfraredGains(double sensitivity) {
    gain_tables_t entries;
    for (size_t i = 0; i < GAIN_ENTRIES; i++) {
        double low = signal(LOW_AT_CONTACT * sensitivity,
                            GAIN_CONTACT_MM + GAIN_SPACING_MM * static_cast<double>(i));
        entries.low[i] = static_cast<uint16_t>(converted(low));
        entries.high[i] = static_cast<uint16_t>(converted(low * HIGH_OVER_LOW));
    }
    tables_ = &shared({entries, false});
}

distance_measurement_t InfraredGains::measure(double distance_mm, double low_noise_lsb,
                                              double high_noise_lsb) const {
    const gain_tables_t &entries = tables_->entries;
    if (tables_->measured) [[unlikely]]
        return {converted(measured_signal(entries.low, distance_mm) + low_noise_lsb),
                converted(measured_signal(entries.high, distance_mm) + high_noise_lsb)};
    return measure_synthetic(entries.low[0], distance_mm, low_noise_lsb, high_noise_lsb);
}

distance_measurement_t InfraredGains::measure_synthetic(uint16_t low_at_contact, double distance_mm,
                                                        double low_noise_lsb,
                                                        double high_noise_lsb) {
    const double low = signal(low_at_contact, distance_mm);
    return {converted(low + low_noise_lsb), converted(low * HIGH_OVER_LOW + high_noise_lsb)};
}

}  // namespace kilotwin
