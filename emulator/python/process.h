/// Registers what concerns the process that the engine runs in.
#ifndef KILOTWIN_PYTHON_PROCESS_H
#define KILOTWIN_PYTHON_PROCESS_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// end_with_parent() of base/parent_death.h. It acts on the whole process that imported the engine,
/// so that only workers of ours call it: never a user's own Python.
void register_process(nanobind::module_ &m);

}  // namespace kilotwin

#endif
