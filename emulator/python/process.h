/// Registers what concerns the process that the engine runs in.
#ifndef KILOTWIN_PYTHON_PROCESS_H
#define KILOTWIN_PYTHON_PROCESS_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// end_with_parent() of base/parent_death.h, confine() and lacking_layers() of base/confinement.h,
/// and reference_loop_s() of base/reference_loop.h. The first two act on the whole process that
/// imported the engine, so that only workers of ours call them: never a user's own Python.
void register_process(nanobind::module_ &m);

}  // namespace kilotwin

#endif
