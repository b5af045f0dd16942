#include "python/grid.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "base/errors.h"
#include "python/arrays.h"
#include "python/bridge.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

// Data frames only, as on a Kilogrid.
bool send_can(PythonSimulation &self, uint32_t bus, uint16_t id, const nb::bytes &data,
              double after_s) {
    CanFrame frame;
    if (id > CanFrame::ID_MAX) throw EngineError("an identifier has 11 bits");
    if (data.size() > CanFrame::DATA_MAX) throw EngineError("a CAN frame has 8 bytes at most");
    frame.id = id;
    frame.dlc = static_cast<uint8_t>(data.size());
    std::memcpy(frame.data.data(), data.c_str(), data.size());
    if (!(after_s >= 0 && after_s <= 1)) throw EngineError("a frame waits for 0 to 1 s");
    const auto after = static_cast<Cycles>(std::llround(after_s * double(CYCLES_PER_SECOND)));
    return self.simulation().grid().send_can(self.simulation().now() + after, bus, frame);
}

// One structured array for all frames, not an object each: a full table has 8,000 a second.
nb::object can_frames(PythonSimulation &self) {
    std::vector<CanRecord> rows;
    for (const auto &logged : self.simulation().grid().take_frames())
        rows.push_back({self.simulation().seconds_of(logged.at), static_cast<uint8_t>(logged.bus),
                        logged.frame.id, logged.frame.dlc, logged.frame.data, logged.from_host});
    nb::module_ numpy = nb::module_::import_("numpy");
    return numpy.attr("frombuffer")(nb::bytes(rows.data(), rows.size() * sizeof(CanRecord)),
                                    numpy.attr("dtype")(can_record_fields()));
}

// Rows from the bottom, columns from the left, two cells a module in either direction.
nb::object cells_of(PythonSimulation &self) {
    Grid &grid = self.simulation().grid();
    const GridLayout &layout = grid.layout();
    const size_t rows = 2 * layout.rows(), columns = 2 * layout.columns();
    auto *values = new std::vector<uint8_t>();
    nb::capsule owner(values,
                      [](void *p) noexcept { delete static_cast<std::vector<uint8_t> *>(p); });
    // A module program may have to run up to now before its LEDs are right.
    NativeGuest::serve_this_thread();
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t column = 0; column < columns; column++) {
            const CellLight light = grid.light(layout.cell(column, row), self.simulation().now());
            values->push_back(light.color());
            values->push_back(light.brightness());
        }
    return nb::cast(
        nb::ndarray<nb::numpy, uint8_t>(values->data(), {rows, columns, size_t{2}}, owner));
}

// In the order of CanBus::State.
const char *name_of(CanBus::State state) {
    static const char *const NAMES[] = {"active", "passive", "bus_off", "dead"};
    return NAMES[static_cast<int>(state)];
}

// State of program, runtime and CAN controller of each module, as of now.
nb::list modules_of(PythonSimulation &self) {
    Grid &grid = self.simulation().grid();
    NativeGuest::serve_this_thread();
    nb::list out;
    for (uint32_t index = 0; index < grid.layout().modules(); index++) {
        const uint32_t on_bus = grid.layout().bus(index), node = grid.node(index);
        const CanBus &bus = grid.bus(on_bus);
        nb::dict row;
        row["x"] = grid.layout().x(index);
        row["y"] = grid.layout().y(index);
        row["bus"] = on_bus;
        const auto &about = grid.about(index, self.simulation().now());
        row["state"] = about.state;
        row["stopped"] = about.stopped;
        row["tick"] = about.ticks;
        row["can"] = name_of(bus.state(node));
        row["tec"] = bus.transmit_errors(node);
        row["rec"] = bus.receive_errors(node);
        row["frames_refused"] = about.frames_refused;
        row["frames_missed"] = about.frames_missed;
        out.append(row);
    }
    return out;
}

// Counts since the begin; `load` is the share of the time in which a bus was busy.
nb::list can_stats(const PythonSimulation &self) {
    const Grid &grid = self.simulation().grid();
    nb::list out;
    for (uint32_t index = 0; index < grid.layout().buses(); index++) {
        const CanBus &bus = grid.bus(index);
        const auto &counts = bus.counts();
        nb::dict row;
        row["load"] = bus.load(self.simulation().now());
        row["frames"] = counts.frames;
        row["error_frames"] = counts.error_frames;
        row["not_acknowledged"] = counts.not_acknowledged;
        row["went_bus_off"] = counts.went_bus_off;
        row["lost_queue_full"] = counts.lost_queue_full;
        row["lost_bus_off"] = counts.lost_bus_off;
        row["lost_dead"] = counts.lost_dead;
        out.append(row);
    }
    return out;
}

// Frames of cells, and robots' frames at cells, since the begin.
nb::dict cell_stats(const PythonSimulation &self) {
    const Grid::Counts &counts = self.simulation().grid().counts;
    nb::dict out;
    out["sent"] = counts.sent;
    out["unheard"] = counts.unheard;
    out["put_off"] = counts.put_off;
    out["received"] = counts.received;
    out["collided"] = counts.collided;
    out["deaf"] = counts.deaf;
    out["elsewhere"] = counts.elsewhere;
    out["lost"] = counts.lost;
    return out;
}

// As Simulation.events(), with a module's column and row in place of a robot.
nb::list module_events(PythonSimulation &self) {
    const GridLayout &layout = self.simulation().grid().layout();
    nb::list out;
    for (const auto &event : self.simulation().take_module_events()) {
        nb::dict row;
        row["tick"] = self.simulation().tick_of(event.at);
        row["module_tick"] = event.tick;
        row["module"] = nb::make_tuple(layout.x(event.robot), layout.y(event.robot));
        describe(row, event);
        out.append(row);
    }
    return out;
}

}  // namespace

void register_grid(nb::class_<PythonSimulation> &simulation) {
    simulation
        .def(
            "send_can", send_can, nb::arg("bus"), nb::arg("id"), nb::arg("data"),
            nb::arg("after_s") = 0.0,
            "Queue a frame at the host's node of a bus, to be sent so long after now, 1 s at most; "
            "False if its queue is full.")
        .def("can_frames", can_frames, "What ended on any bus since the last call.")
        .def("cells", cells_of, "[row, column, 2] of all cells: colour of 3 bits, brightness.")
        .def("modules", modules_of, "One dict per module, row by row from the lower left.")
        .def("can_stats", can_stats, "One dict per bus.")
        .def("cell_stats", cell_stats, "What became of infrared frames from and to cells.")
        .def("module_events", module_events, "Prints and failures of module programs.");
}

}  // namespace kilotwin
