#include "python/bridge.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <chrono>
#include <cstring>
#include <memory>

#include "grid/bridge.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

/// A bridge as Python holds it: open until close().
struct PythonBridge {
    explicit PythonBridge(const Bridge::Settings &settings)
        : bridge(std::make_unique<Bridge>(settings)) {}
    Bridge &open() const {
        if (!bridge) throw BridgeError("this bridge is closed");
        return *bridge;
    }
    std::unique_ptr<Bridge> bridge;
};

/// The rows of a contiguous array of CAN_RECORD.
std::vector<CanRecord> records_of(nb::handle array) {
    Py_buffer view;
    if (PyObject_GetBuffer(array.ptr(), &view, PyBUF_C_CONTIGUOUS) != 0) throw nb::python_error();
    std::vector<CanRecord> records(static_cast<size_t>(view.len) / sizeof(CanRecord));
    bool fits = view.itemsize == sizeof(CanRecord);
    if (fits && view.len > 0) std::memcpy(records.data(), view.buf, static_cast<size_t>(view.len));
    PyBuffer_Release(&view);
    if (!fits) throw nb::type_error("frames are an array of CAN_RECORD");
    return records;
}

// (bus, id, data, how many seconds ago) each, in the order in which they came.
nb::list to_python(const std::vector<Bridge::Request> &requests) {
    const auto now = std::chrono::steady_clock::now();
    nb::list out;
    for (const auto &[bus, frame, came] : requests) {
        const double age_s = std::chrono::duration<double>(now - came).count();
        out.append(nb::make_tuple(bus, frame.id, nb::bytes(frame.data.data(), frame.dlc), age_s));
    }
    return out;
}

// Counts since the bridge was opened (grid/bridge.h).
nb::dict to_python(const Bridge::Counts &counts) {
    nb::dict out;
    out["published"] = counts.published;
    out["lost_outgoing"] = counts.lost_outgoing;
    out["taken"] = counts.taken;
    out["lost_incoming"] = counts.lost_incoming;
    out["malformed"] = counts.malformed;
    out["clients"] = counts.clients;
    out["clients_dropped"] = counts.clients_dropped;
    return out;
}

// Opens all buses, or throws BridgeError and leaves none open.
void construct(PythonBridge *self, size_t buses, uint16_t port, uint16_t more_ports,
               const std::vector<std::string> &interfaces, size_t client_bytes,
               size_t client_frames, size_t clients, double settle_s) {
    const Bridge::Settings settings = {.buses = buses,
                                       .port = port,
                                       .more_ports = more_ports,
                                       .interfaces = interfaces,
                                       .client_bytes = client_bytes,
                                       .client_frames = client_frames,
                                       .clients = clients,
                                       .settle_s = settle_s};
    new (self) PythonBridge(settings);
}

}  // namespace

// Names and types of CanRecord's members, which is packed: little-endian, without gaps.
nb::list can_record_fields() {
    nb::list fields;
    for (auto [name, type] : {std::pair("at_s", "<f8"), std::pair("bus", "u1"),
                              std::pair("id", "<u2"), std::pair("dlc", "u1")})
        fields.append(nb::make_tuple(name, type));
    fields.append(nb::make_tuple("data", "u1", nb::make_tuple(CanFrame::DATA_MAX)));
    fields.append(nb::make_tuple("from_host", "?"));
    return fields;
}

// Calls other than close() are short: a thread of the bridge's own does the work.
void register_bridge(nb::module_ &m) {
    const nb::exception<BridgeError> registered(m, "BridgeError", PyExc_OSError);
    m.attr("CAN_RECORD") = can_record_fields();
    nb::class_<PythonBridge>(m, "Bridge", "The buses for programs outside; see grid/bridge.h.")
        .def("__init__", construct, nb::kw_only(), nb::arg("buses"), nb::arg("port"),
             nb::arg("more_ports"), nb::arg("interfaces"), nb::arg("client_bytes"),
             nb::arg("client_frames"), nb::arg("clients"), nb::arg("settle_s"))
        .def_prop_ro("port", [](const PythonBridge &self) { return self.open().port(); })
        .def_prop_ro("clients", [](const PythonBridge &self) { return self.open().clients(); })
        .def(
            "publish",
            [](const PythonBridge &self, const nb::object &frames) {
                self.open().publish(records_of(frames));
            },
            nb::arg("frames"), "Hands over frames that ended on the buses: rows of CAN_RECORD.")
        .def(
            "take", [](const PythonBridge &self) { return to_python(self.open().take()); },
            "What programs outside want to send since the last call: (bus, id, data).")
        .def("counts", [](const PythonBridge &self) { return to_python(self.open().counts()); })
        .def("notes", [](const PythonBridge &self) { return self.open().notes(); })
        .def(
            "close", [](PythonBridge &self) { self.bridge.reset(); },
            nb::call_guard<nb::gil_scoped_release>(), "Closes all connections.");
}

}  // namespace kilotwin
