/// The parity of a byte.
#ifndef KT_UTIL_PARITY_H
#define KT_UTIL_PARITY_H

#include <stdint.h>

/// 1 if the number of ones is odd, else 0.
#define parity_even_bit(byte) (__builtin_parity((uint8_t)(byte)))

#endif
