#include "kilolib.h"
#include "random.h"
#include "traits.h"

#define TRIES_PER_BIT 128

// Two bits that differ begin with 0 as often as with 1, however often each bit alone is 1.
static uint8_t fair_bit(void) {
    for (uint8_t tries = 0; tries < TRIES_PER_BIT; tries++) {
        const uint8_t first = kilolib_random_noise_bit();
        if (first != kilolib_random_noise_bit()) return first;
    }
    return 0;
}

uint8_t rand_hard(void) {
    uint8_t bits = 0;
    if (KILOLIB_ORIGINAL) kilolib_random_hold();
    for (uint8_t i = 0; i < 8; i++) bits = (uint8_t)(bits << 1) | fair_bit();
    if (KILOLIB_ORIGINAL) kilolib_random_release();
    return bits;
}
