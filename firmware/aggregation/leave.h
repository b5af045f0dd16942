/// How likely a resting robot is to leave at one test: the rules of both controllers.
///
/// A probability is a threshold in Q32, 0 (never) to EXPONENTIAL_ONE (always): the robot leaves if
/// a uniform 32-bit number is below it. Thresholds are computed at each test, once in two seconds,
/// and not when the parameters arrive: a table for 100 neighbours would take 400 of 2,048 bytes.
#ifndef AGGREGATION_LEAVE_H
#define AGGREGATION_LEAVE_H

#include <stdint.h>

/// P = alpha exp(-beta n), at most 1. `alpha` and `beta` are Q16, `n` robots rest within range.
/// The error is below (2 alpha + 1) * 2^-32.
uint64_t leave_simplified(uint32_t alpha, uint32_t beta, uint8_t n);

/// P = exp(-a (k - |n - x|)), at most 1. `a` and `k` are Q16; `n` informed robots are within range
/// now, `x` were when the robot joined. The error is below 2 * 2^-32. (That P = 1 for n = 0 is
/// the caller's business, who knows how often it has heard nobody.)
uint64_t leave_firat(uint32_t a, uint32_t k, uint8_t n, uint8_t x);

#endif
