/// Images for chips, and one robot's chip by itself, as parts of kilotwin._emulator.
#ifndef KILOTWIN_PYTHON_CHIP_H
#define KILOTWIN_PYTHON_CHIP_H

#include <nanobind/nanobind.h>

namespace kilotwin {

/// Adds flash_image() and RobotChip to the module.
void register_chip(nanobind::module_ &m);

}  // namespace kilotwin

#endif
