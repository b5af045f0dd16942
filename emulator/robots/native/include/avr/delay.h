/// The old name of <util/delay.h>.
#ifndef KT_AVR_DELAY_H
#define KT_AVR_DELAY_H

#include "../util/delay.h"

#endif
