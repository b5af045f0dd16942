#include "leave.h"

#include "exponential.h"

uint64_t leave_simplified(uint32_t alpha, uint32_t beta, uint8_t n) {
    const uint64_t decay = exponential_decay(((uint64_t)beta * n) << 16);
    const uint64_t threshold = (alpha * decay) >> 16;  // at most (2^32 - 1) 2^32: no overflow
    return threshold < EXPONENTIAL_ONE ? threshold : EXPONENTIAL_ONE;
}

uint64_t leave_firat(uint32_t a, uint32_t k, uint8_t n, uint8_t x) {
    // In Q16, like k, so that the product with `a` is Q32 without a shift.
    const uint32_t change = (uint32_t)(n > x ? n - x : x - n) << 16;
    if (change >= k) return EXPONENTIAL_ONE;
    return exponential_decay((uint64_t)a * (k - change));
}
