/// What rand_soft() and rand_hard() are made of; robots and the Kilogrid's modules share the rest.
#ifndef KILOLIB_AVR_RANDOM_NOISE_H
#define KILOLIB_AVR_RANDOM_NOISE_H

#include <stdint.h>

/// A bit that is 0 and 1 by chance, though perhaps not equally often. Implemented by who has a
/// converter.
uint8_t kilolib_random_noise_bit(void);

/// The start of rand_soft()'s row.
void kilolib_random_seed(uint8_t seed);

#endif
