#include "random.h"

// Rounds after which each bit of the seed has reached each bit of the state.
#define MIXING_ROUNDS 15

void random_seed(random_t *random, uint32_t seed, uint16_t uid) {
    *random = (random_t){.a = seed, .b = uid, .c = 0, .counter = 1};
    for (uint8_t i = 0; i < MIXING_ROUNDS; i++) random_next(random);
}

// The generator is "sfc32" (Chris Doty-Humphrey, PractRand): a chaotic map of 96 bits to which a
// counter is added, so that no seed leads into a short cycle.
uint32_t random_next(random_t *random) {
    const uint32_t sum = random->a + random->b + random->counter++;
    random->a = random->b ^ (random->b >> 9);
    random->b = random->c + (random->c << 3);
    random->c = (random->c << 21 | random->c >> 11) + sum;
    return sum;
}
