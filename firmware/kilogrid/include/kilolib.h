/// The Kilobot API for Kilogrid programs: the same functions and variables, with the names of the
/// grid's message types (message.h).
#ifndef KILOGRID_KILOLIB_H
#define KILOGRID_KILOLIB_H

#include "message.h"

#include "../../kilolib/include/kilolib.h"

#endif
