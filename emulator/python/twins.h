/// One program on both tiers with the same inputs, as Python has it.
#ifndef KILOTWIN_PYTHON_TWINS_H
#define KILOTWIN_PYTHON_TWINS_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Adds the class Twins to the module.
void register_twins(nanobind::module_ &m);

}  // namespace kilotwin

#endif
