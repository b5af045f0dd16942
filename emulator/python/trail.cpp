#include "python/trail.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "robots/trail.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

#pragma pack(push, 1)
struct ArrivalRow {
    double begin_s, at_s;
    uint8_t from_kind;
    uint32_t from;
    uint8_t to_kind;
    uint32_t to;
    Trail::Bytes bytes;
};
struct InputRow {
    double at_s;
    uint32_t path;
    int32_t value;
};
struct WriteRow {
    double at_s, before_s, heard_s;
    uint32_t heard_nth;
    InputRow drawn, sensed;
    uint32_t robot, tick, path, sent;
    uint16_t address, was, now;
    uint8_t what, during;
};
struct SendingRow {
    double at_s;
    uint32_t robot, number;
    uint16_t address;
    Trail::Bytes bytes;
};
#pragma pack(pop)

using Fields = std::vector<std::pair<const char *, const char *>>;

/// A structured array of rows, whose fields are named in their order.
template <typename Row>
nb::object array_of_rows(const std::vector<Row> &rows, const Fields &fields) {
    nb::list types;
    for (const auto &[name, type] : fields) types.append(nb::make_tuple(name, type));
    nb::module_ numpy = nb::module_::import_("numpy");
    return numpy.attr("frombuffer")(nb::bytes(rows.data(), rows.size() * sizeof(Row)),
                                    numpy.attr("dtype")(types));
}

/// NaN for NEVER.
double seconds_or_nan(const Simulation &simulation, Cycles at) {
    return at == NEVER ? std::nan("") : simulation.seconds_of(at);
}

nb::object arrivals_of(PythonSimulation &self) {
    const Simulation &simulation = self.simulation();
    std::vector<ArrivalRow> rows;
    for (const Trail::Arrival &one : simulation.trail().take_arrivals())
        rows.push_back({simulation.seconds_of(one.begin), simulation.seconds_of(one.at),
                        static_cast<uint8_t>(one.from.kind), one.from.number,
                        static_cast<uint8_t>(one.to.kind), one.to.number, one.bytes});
    return array_of_rows(rows, {{"begin_s", "<f8"},
                                {"at_s", "<f8"},
                                {"from_kind", "u1"},
                                {"from", "<u4"},
                                {"to_kind", "u1"},
                                {"to", "<u4"},
                                {"bytes", "V10"}});
}

nb::object writes_of(const Simulation &simulation) {
    std::vector<WriteRow> rows;
    const auto input_of = [&](const Trail::Input &input) {
        return InputRow{seconds_or_nan(simulation, input.at), input.path, input.value};
    };
    for (const Trail::Write &one : simulation.trail().writes())
        rows.push_back({simulation.seconds_of(one.at), seconds_or_nan(simulation, one.before),
                        seconds_or_nan(simulation, one.heard), one.heard_nth, input_of(one.drawn),
                        input_of(one.sensed), one.robot, one.tick, one.path, one.sent, one.address,
                        one.was, one.now, static_cast<uint8_t>(one.what),
                        static_cast<uint8_t>(one.during)});
    return array_of_rows(rows, {{"at_s", "<f8"},
                                {"before_s", "<f8"},
                                {"heard_s", "<f8"},
                                {"heard_nth", "<u4"},
                                {"drawn_s", "<f8"},
                                {"drawn_path", "<u4"},
                                {"drawn", "<i4"},
                                {"sensed_s", "<f8"},
                                {"sensed_path", "<u4"},
                                {"sensed", "<i4"},
                                {"robot", "<u4"},
                                {"tick", "<u4"},
                                {"path", "<u4"},
                                {"sent", "<u4"},
                                {"address", "<u2"},
                                {"was", "<u2"},
                                {"now", "<u2"},
                                {"what", "u1"},
                                {"during", "u1"}});
}

nb::dict trail_of(const PythonSimulation &self) {
    const Simulation &simulation = self.simulation();
    const Trail &trail = simulation.trail();
    std::vector<SendingRow> sendings;
    for (const Trail::Sending &one : trail.sendings())
        sendings.push_back(
            {simulation.seconds_of(one.at), one.robot, one.number, one.address, one.bytes});
    nb::list paths;
    for (const CodePath &path : trail.paths()) paths.append(nb::cast(path));
    nb::dict out;
    out["writes"] = writes_of(simulation);
    out["sendings"] = array_of_rows(sendings, {{"at_s", "<f8"},
                                               {"robot", "<u4"},
                                               {"number", "<u4"},
                                               {"address", "<u2"},
                                               {"bytes", "V10"}});
    out["paths"] = paths;
    out["forgotten"] = trail.forgotten();
    return out;
}

}  // namespace

void register_trail(nb::class_<PythonSimulation> &simulation) {
    using Extents = std::vector<std::pair<uint32_t, uint32_t>>;
    simulation
        .def(
            "keep_trail",
            [](PythonSimulation &self, size_t capacity, const std::vector<Extents> &draws,
               uint32_t robot, uint16_t begin, uint16_t end) {
                Simulation &world = self.simulation();
                Trail &trail = world.keep_trail(capacity, !draws.empty());
                if (draws.empty()) return;
                if (draws.size() != world.size()) throw EngineError("extents for each robot");
                for (uint32_t one = 0; one < world.size(); one++) trail.draws(one, draws[one]);
                trail.look({robot, begin, end});
            },
            nb::arg("capacity"), nb::arg("draws"), nb::arg("robot"), nb::arg("begin"),
            nb::arg("end"),
            "Keep a trail from now on. `draws`, of each robot: extents of code that draws random "
            "numbers; empty: of frames alone. The variable from address `begin` to below `end` of "
            "a "
            "robot is looked at closely.")
        .def("arrivals", arrivals_of, "Frames that were received since the last call.")
        .def("trail", trail_of, "What robots' code did.");
}

}  // namespace kilotwin
