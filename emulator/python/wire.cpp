#include "python/wire.h"

#include "aggregation/wire.h"

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
}

}  // namespace kilotwin
