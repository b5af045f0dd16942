/// The differential test of the two tiers, native and ATmega328P, as Python has it.
#ifndef KILOTWIN_PYTHON_DIFFERENTIAL_TEST_H
#define KILOTWIN_PYTHON_DIFFERENTIAL_TEST_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Adds the class DifferentialTest to the module. run() takes long and gives up the interpreter's
/// lock.
void register_differential_test(nanobind::module_ &m);

}  // namespace kilotwin

#endif
