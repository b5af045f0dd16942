/// On the AVR: the registers that all devices have. Here they are with the others.
#ifndef KT_AVR_COMMON_H
#define KT_AVR_COMMON_H

#include "io.h"

#endif
