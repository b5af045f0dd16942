/// Older names for access to registers.
#ifndef KT_COMPAT_DEPRECATED_H
#define KT_COMPAT_DEPRECATED_H

#include "../avr/interrupt.h"

#define sbi(port, bit) ((port) = (uint8_t)((port) | _BV(bit)))
#define cbi(port, bit) ((port) = (uint8_t)((port) & ~_BV(bit)))
#define inb(port) (port)
#define outb(port, value) ((port) = (value))
#define inp(port) (port)
#define outp(value, port) ((port) = (value))
#define enable_external_int(mask) (EIMSK = (mask))
#define INTERRUPT(vector) ISR(vector)

#endif
