#include "python/wire.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "aggregation/wire.h"
#include "kilolib/core/gains.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

// From the list that the firmware itself is compiled from, so that the two cannot differ.
nb::dict config_keys() {
    nb::dict keys;
#define ADD_KEY(name, key, preset, least, most)                                   \
    keys[#name] = nb::make_tuple(key##u, preset##u, static_cast<uint32_t>(least), \
                                 static_cast<uint32_t>(most));
    WIRE_CONFIG_KEYS(ADD_KEY)
#undef ADD_KEY
    return keys;
}

// Without its CRC, which the sender adds.
nb::bytes config_message(uint16_t uid_first, uint16_t uid_last, uint8_t key, uint32_t value) {
    uint8_t bytes[WIRE_DATA_BYTES + 1];
    wire_put_config(bytes, {uid_first, uid_last, key, value});
    bytes[WIRE_DATA_BYTES] = WIRE_TYPE_CONFIG;
    return nb::bytes(bytes, sizeof bytes);
}

// As in a robot's EEPROM: readings of 0 to 1023 are the caller's to check.
gain_tables_t tables_of(const std::vector<uint16_t> &low, const std::vector<uint16_t> &high) {
    gain_tables_t tables{};
    if (low.size() != GAIN_ENTRIES || high.size() != GAIN_ENTRIES)
        throw nb::value_error("a table of gains has 14 readings");
    std::copy(low.begin(), low.end(), tables.low);
    std::copy(high.begin(), high.end(), tables.high);
    return tables;
}

// Many readings by the same tables at once, as a host has them after a measurement.
nb::list estimate_distances(const std::vector<uint16_t> &low, const std::vector<uint16_t> &high,
                            const std::vector<std::pair<int16_t, int16_t>> &readings) {
    const gain_tables_t tables = tables_of(low, high);
    nb::list distances;
    for (const auto &[low_gain, high_gain] : readings) {
        const distance_measurement_t measured = {low_gain, high_gain};
        distances.append(kilolib_gains_distance(&tables, &measured));
    }
    return distances;
}

// Only what the host needs: TRACKING is the grid's own type.
nb::dict types_and_flags() {
    nb::dict wire;
    wire["TYPE_CELL"] = int(WIRE_TYPE_CELL);
    wire["TYPE_SIGNAL"] = int(WIRE_TYPE_SIGNAL);
    wire["TYPE_CONFIG"] = int(WIRE_TYPE_CONFIG);
    wire["CELL_WALL"] = WIRE_CELL_WALL;
    wire["CELL_OBSTACLE"] = WIRE_CELL_OBSTACLE;
    return wire;
}

}  // namespace

void register_wire(nb::module_ &m) {
    m.attr("CONFIG_KEYS") = config_keys();
    m.attr("WIRE") = types_and_flags();
    m.def("config_message", config_message, nb::arg("uid_first"), nb::arg("uid_last"),
          nb::arg("key"), nb::arg("value"), "A CONFIG message: nine data bytes and the type.");
    m.def("estimate_distances", estimate_distances, nb::arg("low_gain"), nb::arg("high_gain"),
          nb::arg("readings"),
          "Distances in mm by a robot's tables, of readings of the low and the high gain.");
}

}  // namespace kilotwin
