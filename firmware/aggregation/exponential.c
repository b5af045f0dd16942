#include "exponential.h"

#define LN_2 UINT32_C(2977044472)  // Q32

// x^13 / 13! is below 2^-39 for x < ln 2, so twelve terms are enough.
#define TERMS 12

uint64_t exponential_decay(uint64_t x) {
    // exp(-x) = exp(-rest) / 2^halvings, the rest below ln 2. 32 halvings leave less than 2^-32.
    uint8_t halvings = 0;
    while (x >= LN_2) {
        x -= LN_2;
        if (++halvings == 32) return 0;
    }

    // 1 - x/1 (1 - x/2 (1 - x/3 (...))): the nested form needs no table, and each division by a
    // small number shrinks the rounding errors of the steps before it.
    uint64_t sum = EXPONENTIAL_ONE;
    for (uint8_t term = TERMS; term > 0; term--) {
        sum = EXPONENTIAL_ONE - (uint32_t)(x * sum >> 32) / term;
    }
    return sum >> halvings;
}
