/// Questions to robots: whom they are for, and the slots of the answers.
#include "kilolib/core/robot_query.h"

#include "../../firmware/support.h"

TEST(a_question_is_for_all_or_for_one) {
    const uint8_t one[] = {0xE1, 0, 0, 0x34, 0x12}, all[] = {0xE1, 0, 0, 0xFF, 0xFF};
    assert_true(robot_query_is_for(one, 0x1234));
    assert_false(robot_query_is_for(one, 0x1235));
    assert_false(robot_query_is_for(one, 0x1334));
    assert_false(robot_query_is_for(one, 0xFFFF));
    assert_true(robot_query_is_for(all, 0x1234));
    assert_true(robot_query_is_for(all, 0xFFFF));
}

TEST(slots_are_within_their_number) {
    for (uint16_t power = 0; power < 256; power++)
        for (uint32_t uid = 0; uid < 65536; uid += 37) {
            const uint8_t slot = robot_query_slot((uint16_t)uid, 9, (uint8_t)power);
            if (power < 8) assert_true(slot < 1u << power);
            if (power > 8) assert_int_equal(slot, robot_query_slot((uint16_t)uid, 9, 8));
        }
}

// Senders compute it as well.
TEST(the_slot_is_the_upper_bits_of_a_product) {
    assert_int_equal(robot_query_slot(1, 0, 8), 0x9E);
    assert_int_equal(robot_query_slot(1, 1, 8), 0x0B);
    assert_int_equal(robot_query_slot(0x1234, 7, 4), (0x1234u * (0x9E37 + 7u * 0x6D2A) >> 12) & 15);
    assert_int_equal(robot_query_slot(65535, 255, 1),
                     (65535u * ((0x9E37 + 255u * 0x6D2A) & 0xFFFF) >> 15) & 1);
}

// As many robots as slots: by pure chance 1/e of them are alone in theirs, 23.5 of 64.
TEST(uids_in_a_row_are_spread_as_by_chance) {
    uint32_t alone = 0;
    for (int nonce = 0; nonce < 256; nonce++) {
        uint32_t used[64] = {0};
        for (uint16_t uid = 1; uid <= 64; uid++) used[robot_query_slot(uid, (uint8_t)nonce, 6)]++;
        for (int slot = 0; slot < 64; slot++) alone += used[slot] == 1;
    }
    assert_true(alone > 256 * 20);
}

TEST(robots_that_share_a_slot_part_with_another_nonce) {
    uint32_t seed = 3, worst = 0;
    for (int pair = 0; pair < 5000; pair++) {
        const uint16_t one = (uint16_t)((seed = seed * 1664525 + 1013904223) >> 16);
        const uint16_t two = (uint16_t)((seed = seed * 1664525 + 1013904223) >> 16);
        uint32_t shared = 0;
        if (one == two) continue;
        for (int nonce = 0; nonce < 256; nonce++)
            shared += robot_query_slot(one, (uint8_t)nonce, 6) ==
                      robot_query_slot(two, (uint8_t)nonce, 6);
        if (shared > worst) worst = shared;
    }
    assert_true(worst <= 64);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_question_is_for_all_or_for_one),
        cmocka_unit_test(slots_are_within_their_number),
        cmocka_unit_test(the_slot_is_the_upper_bits_of_a_product),
        cmocka_unit_test(uids_in_a_row_are_spread_as_by_chance),
        cmocka_unit_test(robots_that_share_a_slot_part_with_another_nonce),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
