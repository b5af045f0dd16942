#include "kilolib.h"
#include "random.h"

static uint8_t state = 0xAA;
static uint8_t accumulator;

// An 8-bit xorshift and a counter that seeding leaves alone (hardware.md 1.7).
uint8_t rand_soft(void) {
    state ^= (uint8_t)(state << 3);
    state ^= state >> 5;
    state ^= accumulator >> 2;
    accumulator++;
    return state;
}

void kilolib_random_seed(uint8_t seed) { state = seed; }
