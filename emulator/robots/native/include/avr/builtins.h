/// Instructions by the names that avr-gcc has for them, which need no header.
#ifndef KT_AVR_BUILTINS_H
#define KT_AVR_BUILTINS_H

#include "../kt_avr.h"

#endif
