/// The registers of the robot's ATmega328P.
#ifndef KT_AVR_IO_H
#define KT_AVR_IO_H

#include "sfr_defs.h"

#include "fuse.h"
#include "iom328p.h"
#include "lock.h"
#include "portpins.h"
#include "version.h"

#endif
