/// The firmware's own random numbers: 32 bits at a time, the same sequence on every machine.
#ifndef AGGREGATION_RANDOM_H
#define AGGREGATION_RANDOM_H

#include <stdint.h>

/// The caller owns it; no field is of interest outside random.c.
typedef struct {
    uint32_t a;
    uint32_t b;
    uint32_t c;
    uint32_t counter;
} random_t;

/// Starts one of 2^48 sequences. Any values will do, zeros and neighbouring numbers too.
void random_seed(random_t *random, uint32_t seed, uint16_t uid);

/// Uniform over 0..2^32 - 1. The period is at least 2^32 draws. Adds, shifts and exclusive ors
/// only: about 150 cycles on an AVR.
uint32_t random_next(random_t *random);

#endif
