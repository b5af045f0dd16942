#include "python/process.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "base/confinement.h"
#include "base/parent_death.h"
#include "base/reference_loop.h"
#include "robots/native/stack.h"
#include "robots/translated/program.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

std::vector<std::string> confine(std::vector<std::string> readable,
                                 std::vector<std::string> writable, uint64_t memory_bytes,
                                 uint64_t file_bytes, std::string memory_group, bool sockets,
                                 bool loads_later, bool forks) {
    // Its timers and handlers cannot be made later.
    GuestStack::serve_this_thread();
    GuestStack::attend_system_calls();
    // simavr's debugger takes an interrupted select() for a connection.
    if (!sockets) GuestStack::watch_sleep();
    return confine_worker({std::move(readable),
                           {},
                           std::move(writable),
                           memory_bytes,
                           file_bytes,
                           std::move(memory_group),
                           sockets,
                           loads_later,
                           forks});
}

}  // namespace

void register_process(nb::module_ &m) {
    m.def("end_with_parent", &end_with_parent, nb::arg("parent"), nb::arg("grace_s") = 0.0,
          "Has this process killed so many seconds after the process `parent`, its parent, ends.");
    m.def("confine", &confine, nb::kw_only(), nb::arg("readable"), nb::arg("writable"),
          nb::arg("memory_bytes"), nb::arg("file_bytes"), nb::arg("memory_group"),
          nb::arg("sockets"), nb::arg("loads_later"), nb::arg("forks"),
          "Leaves this process, for good, these files and folders and what it has open; returns "
          "the layers that the kernel lacks.");
    m.def("end_loading", &end_loading, "No faster code comes any more; see base/confinement.h.");
    m.def("take_over", &TranslatedProgram::take_over, nb::arg("path"), nb::arg("faster"),
          "Executes a loaded translation by faster code from now on; see "
          "robots/translated/program.h.");
    m.def(
        "hold_by", &TranslatedProgram::hold_by, nb::arg("path"), nb::arg("name"),
        nb::arg("debugged"), nb::arg("watched"),
        "Executes robots that a debugger holds, and one of which it notes what it writes, by this "
        "code; see robots/translated/program.h.");
    m.def("lacking_layers", &lacking_layers, "Layers of confine() that this kernel lacks.");
    m.def("reference_loop_s", &reference_loop_s, "CPU time of a loop that never changes, in s.");
}

}  // namespace kilotwin
