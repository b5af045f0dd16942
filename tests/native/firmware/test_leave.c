#include "leave.h"

#include <stdlib.h>

#include "exponential.h"
#include "support.h"

#define Q16(x) ((uint32_t)((x)*65536.0 + 0.5))

// Q16 values of all sizes, the paper's and both ends among them.
static const uint32_t VALUES[] = {
    0,         1,          2,          1000,       Q16(0.25),  Q16(0.5),        Q16(1),
    Q16(1.5),  Q16(2),     Q16(2.25),  Q16(17.99), Q16(18),    Q16(18) + 1,     Q16(99),
    Q16(1000), Q16(32767), Q16(32768), 0x7FFFFFFF, 0x80000000, UINT32_MAX - 1u, UINT32_MAX,
};
#define VALUE_COUNT (sizeof VALUES / sizeof *VALUES)

static void assert_near(uint64_t threshold, long double probability, long double limit) {
    const long double exact = probability < 1 ? probability * 4294967296.0L : 4294967296.0L;
    assert_true(threshold <= EXPONENTIAL_ONE);
    if (fabsl((long double)threshold - exact) >= limit) {
        fail_msg("threshold %llu, exactly %Lf, allowed %Lf", (unsigned long long)threshold, exact,
                 limit);
    }
}

TEST(the_simplified_rule_is_right_for_all_parameters) {
    for (size_t i = 0; i < VALUE_COUNT; i++) {
        for (size_t j = 0; j < VALUE_COUNT; j++) {
            const long double alpha = VALUES[i] / 65536.0L;
            const long double beta = VALUES[j] / 65536.0L;
            for (int n = 0; n <= 101; n++) {
                assert_near(leave_simplified(VALUES[i], VALUES[j], (uint8_t)n),
                            alpha * expl(-beta * n), 2 * alpha + 1);
            }
        }
    }
}

TEST(the_simplified_rule_gives_the_papers_numbers) {
    const uint32_t alpha = Q16(0.5);
    const uint32_t beta = Q16(2.25);
    assert_int_equal(leave_simplified(alpha, beta, 0), EXPONENTIAL_ONE / 2);
    assert_near(leave_simplified(alpha, beta, 1), 0.0526996122810L, 2);
    assert_near(leave_simplified(alpha, beta, 5), 6.503648827034e-06L, 2);
    assert_int_equal(leave_simplified(alpha, beta, 9), 3);   // 3.45 2^-32
    assert_int_equal(leave_simplified(alpha, beta, 10), 0);  // 0.36 2^-32: below the least
}

TEST(the_simplified_rule_saturates_at_certainty) {
    assert_int_equal(leave_simplified(Q16(1), 0, 50), EXPONENTIAL_ONE);
    assert_int_equal(leave_simplified(Q16(8), Q16(2), 1), EXPONENTIAL_ONE);
    assert_int_equal(leave_simplified(UINT32_MAX, 0, 0), EXPONENTIAL_ONE);
}

TEST(with_alpha_zero_nobody_leaves) {
    for (int n = 0; n <= 101; n++) assert_int_equal(leave_simplified(0, 1, (uint8_t)n), 0);
}

TEST(firats_rule_is_right_for_all_parameters) {
    for (size_t i = 0; i < VALUE_COUNT; i++) {
        for (size_t j = 0; j < VALUE_COUNT; j++) {
            const long double a = VALUES[i] / 65536.0L;
            const long double k = VALUES[j] / 65536.0L;
            for (int n = 1; n <= 100; n++) {
                const uint8_t x = (uint8_t)(n % 7 * 15);
                const long double exponent = -a * (k - abs(n - x));
                const long double p = exponent < 0 ? expl(exponent) : 1;
                assert_near(leave_firat(VALUES[i], VALUES[j], (uint8_t)n, x), p, 2);
            }
        }
    }
}

TEST(firats_rule_asks_how_much_the_number_has_changed_either_way) {
    for (uint8_t n = 0; n <= 100; n++) {
        for (uint8_t x = 0; x <= 100; x++) {
            assert_int_equal(leave_firat(Q16(2), Q16(18), n, x),
                             leave_firat(Q16(2), Q16(18), x, n));
        }
    }
}

TEST(firats_rule_is_certain_from_a_change_of_k_on) {
    assert_true(leave_firat(Q16(2), Q16(18), 20, 3) < EXPONENTIAL_ONE);
    assert_int_equal(leave_firat(Q16(2), Q16(18), 20, 2), EXPONENTIAL_ONE);
    assert_int_equal(leave_firat(Q16(2), Q16(18), 2, 21), EXPONENTIAL_ONE);
    assert_int_equal(leave_firat(Q16(2), 0, 1, 1), EXPONENTIAL_ONE);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_simplified_rule_is_right_for_all_parameters),
        cmocka_unit_test(the_simplified_rule_gives_the_papers_numbers),
        cmocka_unit_test(the_simplified_rule_saturates_at_certainty),
        cmocka_unit_test(with_alpha_zero_nobody_leaves),
        cmocka_unit_test(firats_rule_is_right_for_all_parameters),
        cmocka_unit_test(firats_rule_asks_how_much_the_number_has_changed_either_way),
        cmocka_unit_test(firats_rule_is_certain_from_a_change_of_k_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
