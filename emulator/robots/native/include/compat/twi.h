/// The old name of <util/twi.h>.
#ifndef KT_COMPAT_TWI_H
#define KT_COMPAT_TWI_H

#include "../util/twi.h"

#endif
