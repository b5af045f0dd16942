/// The programmer in front of a simulated chip, as kilotwin._emulator.Programmer.
#ifndef KILOTWIN_PYTHON_PROGRAMMER_H
#define KILOTWIN_PYTHON_PROGRAMMER_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Adds the class to the module.
void register_programmer(nanobind::module_ &m);

}  // namespace kilotwin

#endif
