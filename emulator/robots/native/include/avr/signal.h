/// The old name of <avr/interrupt.h>.
#ifndef KT_AVR_SIGNAL_H
#define KT_AVR_SIGNAL_H

#include "interrupt.h"

#endif
