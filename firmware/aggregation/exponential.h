/// exp(-x) in fixed point, for probabilities.
#ifndef AGGREGATION_EXPONENTIAL_H
#define AGGREGATION_EXPONENTIAL_H

#include <stdint.h>

/// The number one in Q32 (a real number times 2^32). It takes 33 bits, hence the 64-bit results: a
/// uniform 32-bit number is below ONE always, and below 0 never, so both certainties are exact.
#define EXPONENTIAL_ONE ((uint64_t)1 << 32)

/// exp(-x), `x` and the result in Q32, for every x from 0 to 2^32 (as a number, not its bits).
///
/// The error is below 2 * 2^-32 everywhere; the result lies in 0..ONE, exp(-0) is exactly ONE, and
/// what is below 2^-32 (x above 22.18) is exactly 0. Takes some 10,000 cycles on an AVR.
uint64_t exponential_decay(uint64_t x);

#endif
