#include "python/process.h"

#include "base/parent_death.h"

namespace nb = nanobind;

namespace kilotwin {

void register_process(nb::module_ &m) {
    m.def("end_with_parent", &end_with_parent, nb::arg("parent"), nb::arg("grace_s") = 0.0,
          "Has this process killed so many seconds after the process `parent`, its parent, ends.");
}

}  // namespace kilotwin
