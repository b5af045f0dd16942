/// The Kilobot API for Kilogrid programs: the same, with the grid's message types.
#ifndef KILOGRID_KILOLIB_H
#define KILOGRID_KILOLIB_H

#include "message.h"

#include "../../kilolib/include/kilolib.h"

#endif
