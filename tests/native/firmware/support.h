/// Shared by all tests of the firmware: CMocka, and statistics with limits that follow from the
/// sample size.
#ifndef FIRMWARE_TESTS_SUPPORT_H
#define FIRMWARE_TESTS_SUPPORT_H

// CMocka wants these before its own header.
// clang-format off
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on
#include <math.h>

#define PI 3.14159265358979323846

/// A test function: no test here keeps state between set-up and body.
#define TEST(name) static void name(void **unused_state __attribute__((unused)))

/// `hits` out of `draws` agree with the probability `p` within five standard deviations, plus one
/// for the whole numbers: a right program fails once in a million.
static inline void assert_binomial(uint32_t hits, uint32_t draws, double p) {
    const double limit = 5 * sqrt(draws * p * (1 - p)) + (p > 0 && p < 1 ? 1 : 0);
    const double off = fabs(hits - draws * p);
    if (off > limit) {
        fail_msg("%u of %u hits, expected %.1f within %.1f", hits, draws, draws * p, limit);
    }
}

#endif
