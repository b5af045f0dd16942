#include "random.h"

#include "support.h"

#define DRAWS 400000

static random_t seeded(uint32_t seed, uint16_t uid) {
    random_t random;
    random_seed(&random, seed, uid);
    return random;
}

// Golden numbers: a robot, an emulated robot and a replay of an old run have to agree on them.
// They were computed by another program, from the published recurrence.
TEST(the_sequence_of_a_seed_never_changes) {
    random_t random = seeded(1, 2);
    assert_int_equal(random_next(&random), 0x8568123F);
    assert_int_equal(random_next(&random), 0x03A4568E);
    for (int i = 2; i < 999; i++) random_next(&random);
    assert_int_equal(random_next(&random), 0x0D41E348);
}

TEST(all_zero_seeds_give_numbers_like_any_other) {
    random_t random = seeded(0, 0);
    uint32_t ones = 0;
    for (int i = 0; i < 1000; i++) ones += (uint32_t)__builtin_popcount(random_next(&random));
    assert_binomial(ones, 32000, 0.5);
}

TEST(neighbouring_seeds_and_uids_give_unlike_numbers) {
    uint32_t unlike = 0;
    for (uint32_t seed = 0; seed < 1000; seed++) {
        random_t one = seeded(seed, 7);
        random_t next_seed = seeded(seed + 1, 7);
        random_t next_uid = seeded(seed, 8);
        const uint32_t draw = random_next(&one);
        unlike += (uint32_t)__builtin_popcount(draw ^ random_next(&next_seed));
        unlike += (uint32_t)__builtin_popcount(draw ^ random_next(&next_uid));
    }
    assert_binomial(unlike, 64000, 0.5);
}

TEST(every_bit_is_set_half_of_the_time) {
    random_t random = seeded(3, 4);
    uint32_t set[32] = {0};
    for (int i = 0; i < DRAWS; i++) {
        const uint32_t draw = random_next(&random);
        for (int bit = 0; bit < 32; bit++) set[bit] += draw >> bit & 1;
    }
    for (int bit = 0; bit < 32; bit++) assert_binomial(set[bit], DRAWS, 0.5);
}

TEST(draws_that_follow_each_other_are_independent) {
    random_t random = seeded(5, 6);
    uint32_t pairs[16][16] = {{0}};
    uint32_t before = random_next(&random) >> 28;
    for (int i = 0; i < DRAWS; i++) {
        const uint32_t draw = random_next(&random) >> 28;
        pairs[before][draw]++;
        before = draw;
    }
    double chi_square = 0;
    for (int i = 0; i < 256; i++) {
        const double off = pairs[i / 16][i % 16] - DRAWS / 256.0;
        chi_square += off * off / (DRAWS / 256.0);
    }
    assert_true(chi_square < 370);  // 255 degrees of freedom: exceeded once in 300,000
    assert_true(chi_square > 165);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_sequence_of_a_seed_never_changes),
        cmocka_unit_test(all_zero_seeds_give_numbers_like_any_other),
        cmocka_unit_test(neighbouring_seeds_and_uids_give_unlike_numbers),
        cmocka_unit_test(every_bit_is_set_half_of_the_time),
        cmocka_unit_test(draws_that_follow_each_other_are_independent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
