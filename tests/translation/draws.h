/// Random states for the harnesses of translated code: xorshift64*, from a seed that is not 0.
#ifndef KILOTWIN_TESTS_TRANSLATION_DRAWS_H
#define KILOTWIN_TESTS_TRANSLATION_DRAWS_H

#include <stdint.h>

static uint64_t seed;

static uint64_t draw_64_bits(void) {
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return seed * 0x2545F4914F6CDD1Du;
}

static uint64_t draw(void) { return draw_64_bits() >> 11; }

#endif
