/// The old name of <util/parity.h>.
#ifndef KT_AVR_PARITY_H
#define KT_AVR_PARITY_H

#include "../util/parity.h"

#endif
