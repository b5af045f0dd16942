#include "transfer.h"

#include <string.h>

#include "support.h"

// Types, as the specification numbers them.
enum {
    FORWARD_IR = 0x01,
    KILO_PAGE = 0x03,
    KILO_SIZE = 0x04,
    KILO_NUMBER = 0x05,
    OWN_PAGE = 0x07,
    OWN_SIZE = 0x08,
    OWN_NUMBER = 0x09,
    CONFIG_SIZE = 0x0F,
    CONFIG = 0x10,
    OLD = 0x9F,  // added to the types of the module's boot loader by the original dispatcher
};

static transfer_t fresh(void) {
    transfer_t transfer;
    memset(&transfer, 0xA5, sizeof transfer);
    transfer_init(&transfer);
    return transfer;
}

static transfer_event_t send(transfer_t *transfer, uint8_t type, uint8_t number, uint8_t value) {
    const uint8_t data[8] = {type, number, value};
    return transfer_receive(transfer, data, 8);
}

// Chunk `number` of something whose byte i is i + 1.
static transfer_event_t chunk(transfer_t *transfer, uint8_t type, uint8_t number) {
    uint8_t data[8] = {type, number};
    for (uint8_t i = 0; i < 6; i++) data[2 + i] = (uint8_t)(6 * number + i + 1);
    return transfer_receive(transfer, data, 8);
}

static void assert_counted(const transfer_t *transfer, uint16_t too_short, uint16_t out_of_range,
                           uint16_t out_of_order) {
    assert_int_equal(transfer->dropped.too_short, too_short);
    assert_int_equal(transfer->dropped.out_of_range, out_of_range);
    assert_int_equal(transfer->dropped.out_of_order, out_of_order);
}

static void assert_bytes(const uint8_t *data, uint8_t count) {
    for (uint8_t i = 0; i < count; i++) assert_int_equal(data[i], i + 1);
}

TEST(a_configuration_of_any_length_comes_in_as_many_chunks_as_it_needs) {
    for (uint8_t size = 1; size <= 48; size++) {
        transfer_t transfer = fresh();
        const uint8_t chunks = (uint8_t)((size + 5) / 6);
        assert_int_equal(send(&transfer, CONFIG_SIZE, 0, size), TRANSFER_CONFIG_BEGUN);
        for (uint8_t i = 0; i + 1 < chunks; i++)
            assert_int_equal(chunk(&transfer, CONFIG, i), TRANSFER_GOES_ON);
        assert_int_equal(chunk(&transfer, CONFIG, (uint8_t)(chunks - 1)), TRANSFER_CONFIG_DONE);
        assert_int_equal(transfer.config.size, size);
        assert_bytes(transfer.config.data, size);
        for (uint8_t i = size; i < 48; i++) assert_int_equal(transfer.config.data[i], 0);
        assert_int_equal(chunk(&transfer, CONFIG, chunks % 8), TRANSFER_REFUSED);
        assert_counted(&transfer, 0, 0, 1);
    }
}

TEST(a_configuration_of_no_or_too_many_bytes_is_refused_and_leaves_the_old_one) {
    transfer_t transfer = fresh();
    send(&transfer, CONFIG_SIZE, 0, 6);
    chunk(&transfer, CONFIG, 0);
    assert_int_equal(send(&transfer, CONFIG_SIZE, 0, 0), TRANSFER_REFUSED);
    for (uint16_t size = 49; size <= 255; size++)
        assert_int_equal(send(&transfer, CONFIG_SIZE, 0, (uint8_t)size), TRANSFER_REFUSED);
    assert_int_equal(transfer.config.size, 6);
    assert_bytes(transfer.config.data, 6);
    assert_counted(&transfer, 0, 208, 0);
}

TEST(the_chunks_of_a_refused_configuration_do_not_become_part_of_the_one_before) {
    transfer_t transfer = fresh();
    send(&transfer, CONFIG_SIZE, 0, 6);
    send(&transfer, CONFIG_SIZE, 0, 49);
    assert_int_equal(chunk(&transfer, CONFIG, 0), TRANSFER_REFUSED);
}

TEST(a_configuration_without_its_size_is_dropped) {
    transfer_t transfer = fresh();
    assert_int_equal(chunk(&transfer, CONFIG, 0), TRANSFER_REFUSED);
    assert_int_equal(transfer.config.size, 0);
    assert_counted(&transfer, 0, 0, 1);
}

TEST(a_configuration_that_loses_or_repeats_or_swaps_a_chunk_is_dropped_whole) {
    const uint8_t orders[][5] = {
        {0, 2, 3, 4, 4}, {0, 1, 1, 2, 3}, {0, 2, 1, 3, 4}, {1, 2, 3, 4, 0}};
    for (uint8_t n = 0; n < 4; n++) {
        transfer_t transfer = fresh();
        send(&transfer, CONFIG_SIZE, 0, 30);
        for (uint8_t i = 0; i < 5; i++)
            assert_int_not_equal(chunk(&transfer, CONFIG, orders[n][i]), TRANSFER_CONFIG_DONE);
        assert_true(transfer.dropped.out_of_order >= 3);
        // Begun anew it comes through.
        send(&transfer, CONFIG_SIZE, 0, 30);
        for (uint8_t i = 0; i < 4; i++) chunk(&transfer, CONFIG, i);
        assert_int_equal(chunk(&transfer, CONFIG, 4), TRANSFER_CONFIG_DONE);
    }
}

TEST(an_abandoned_configuration_does_not_go_on) {
    transfer_t transfer = fresh();
    send(&transfer, CONFIG_SIZE, 0, 12);
    chunk(&transfer, CONFIG, 0);
    transfer_abandon_config(&transfer);
    assert_int_equal(chunk(&transfer, CONFIG, 1), TRANSFER_REFUSED);
}

TEST(an_infrared_message_comes_in_two_frames) {
    transfer_t transfer = fresh();
    const uint8_t first[8] = {FORWARD_IR, 0, 1, 2, 3, 4, 5, 6};
    const uint8_t second[8] = {FORWARD_IR, 1, 7, 8, 9, 0x88};
    assert_int_equal(transfer_receive(&transfer, first, 8), TRANSFER_GOES_ON);
    assert_int_equal(transfer_receive(&transfer, second, 8), TRANSFER_IR_DONE);
    assert_bytes(transfer.ir.data, 9);
    assert_int_equal(transfer.ir.type, 0x88);
}

TEST(half_an_infrared_message_is_none) {
    transfer_t transfer = fresh();
    const uint8_t first[8] = {FORWARD_IR, 0, 1, 2, 3, 4, 5, 6};
    const uint8_t second[8] = {FORWARD_IR, 1, 7, 8, 9, 0x88};
    const uint8_t third[8] = {FORWARD_IR, 2};
    assert_int_equal(transfer_receive(&transfer, second, 8), TRANSFER_REFUSED);
    transfer_receive(&transfer, first, 8);
    assert_int_equal(transfer_receive(&transfer, third, 8), TRANSFER_REFUSED);
    // A part 0 that comes twice is the same as once, a part 1 that does is dropped.
    transfer_receive(&transfer, first, 8);
    assert_int_equal(transfer_receive(&transfer, second, 8), TRANSFER_IR_DONE);
    assert_int_equal(transfer_receive(&transfer, second, 8), TRANSFER_REFUSED);
    assert_counted(&transfer, 0, 1, 2);
}

static void take_page(transfer_t *transfer, uint8_t offset, transfer_event_t done) {
    for (uint8_t i = 0; i < 21; i++)
        assert_int_equal(chunk(transfer, (uint8_t)(3 + offset), i), TRANSFER_GOES_ON);
    assert_int_equal(chunk(transfer, (uint8_t)(3 + offset), 21), done);
}

TEST(the_pages_of_a_robots_program_come_round_and_round) {
    transfer_t transfer = fresh();
    assert_int_equal(send(&transfer, KILO_SIZE, 0, 2), TRANSFER_ANNOUNCED);
    for (uint8_t lap = 0; lap < 3; lap++)
        for (uint8_t page = 0; page < 2; page++) {
            assert_int_equal(send(&transfer, KILO_NUMBER, 0, page), TRANSFER_PAGE_BEGUN);
            take_page(&transfer, 0, TRANSFER_PAGE_DONE);
            assert_int_equal(transfer.kilo.page, page);
            assert_bytes(transfer.kilo.data, 128);
            assert_int_equal(chunk(&transfer, KILO_PAGE, 21), TRANSFER_REFUSED);
        }
    assert_counted(&transfer, 0, 0, 6);
}

// Part 1 of an announcement, whose bytes are 1 to 6.
static transfer_event_t check(transfer_t *transfer, uint8_t type, uint8_t length) {
    const uint8_t data[8] = {type, 1, 1, 2, 3, 4, 5, 6};
    return transfer_receive(transfer, data, length);
}

TEST(a_check_holds_for_the_next_number_of_pages_and_for_no_other) {
    const uint8_t types[] = {KILO_SIZE, OWN_SIZE, OWN_SIZE + OLD};
    for (uint8_t i = 0; i < sizeof types; i++) {
        transfer_t transfer = fresh();
        const transfer_page_t *program = types[i] == KILO_SIZE ? &transfer.kilo : &transfer.own;
        send(&transfer, types[i], 0, 9);
        assert_false(program->checked);
        assert_int_equal(check(&transfer, types[i], 8), TRANSFER_GOES_ON);
        // The program that is on its way stays what it was.
        assert_false(program->checked);
        assert_int_equal(program->pages, 9);
        send(&transfer, types[i], 0, 221);
        send(&transfer, types[i], 0, 10);
        assert_true(program->checked);
        assert_int_equal(program->pages, 10);
        assert_bytes(program->check, 6);
        send(&transfer, types[i], 0, 10);
        assert_false(program->checked);
    }
}

TEST(a_part_of_an_announcement_that_cannot_be_is_refused) {
    transfer_t transfer = fresh();
    for (uint8_t length = 3; length < 8; length++)
        assert_int_equal(check(&transfer, KILO_SIZE, length), TRANSFER_REFUSED);
    for (uint16_t part = 2; part <= 255; part++)
        assert_int_equal(send(&transfer, KILO_SIZE, (uint8_t)part, 9), TRANSFER_REFUSED);
    assert_int_equal(transfer.kilo.pages, 0);
    assert_counted(&transfer, 5, 254, 0);
    send(&transfer, KILO_SIZE, 0, 9);
    assert_false(transfer.kilo.checked);
}

TEST(a_page_that_cannot_be_is_refused_with_its_chunks) {
    transfer_t transfer = fresh();
    assert_int_equal(send(&transfer, KILO_NUMBER, 0, 0), TRANSFER_REFUSED);  // size unknown
    assert_int_equal(send(&transfer, KILO_SIZE, 0, 0), TRANSFER_REFUSED);
    assert_int_equal(send(&transfer, KILO_SIZE, 0, 221), TRANSFER_REFUSED);
    send(&transfer, KILO_SIZE, 0, 220);
    assert_int_equal(send(&transfer, KILO_NUMBER, 0, 219), TRANSFER_PAGE_BEGUN);
    chunk(&transfer, KILO_PAGE, 0);
    assert_int_equal(send(&transfer, KILO_NUMBER, 0, 220), TRANSFER_REFUSED);
    assert_int_equal(chunk(&transfer, KILO_PAGE, 1), TRANSFER_REFUSED);
    assert_int_equal(transfer.kilo.page, 219);
    send(&transfer, KILO_NUMBER, 0, 0);
    assert_int_equal(chunk(&transfer, KILO_PAGE, 22), TRANSFER_REFUSED);
    assert_int_equal(chunk(&transfer, KILO_PAGE, 255), TRANSFER_REFUSED);
    assert_counted(&transfer, 0, 6, 1);
}

TEST(a_page_without_its_number_is_dropped_whatever_was_in_memory) {
    for (int kind = 0; kind < 2; kind++) {
        transfer_t transfer = fresh();
        const uint8_t type = kind == 0 ? KILO_PAGE : OWN_PAGE;
        for (uint8_t i = 0; i < 22; i++)
            assert_int_equal(chunk(&transfer, type, i), TRANSFER_REFUSED);
        assert_counted(&transfer, 0, 0, 22);
    }
}

TEST(a_page_that_loses_repeats_or_swaps_a_chunk_is_dropped) {
    for (uint8_t at = 0; at < 22; at++)
        for (uint8_t fault = 0; fault < 3; fault++) {
            transfer_t transfer = fresh();
            send(&transfer, KILO_SIZE, 0, 1);
            send(&transfer, KILO_NUMBER, 0, 0);
            bool done = false;
            for (uint8_t i = 0; i < 22; i++) {
                if (i == at && fault == 0) continue;
                uint8_t number = i;
                if (fault == 2 && at < 21 && i == at) number = (uint8_t)(i + 1);
                if (fault == 2 && at < 21 && i == at + 1) number = at;
                done |= chunk(&transfer, KILO_PAGE, number) == TRANSFER_PAGE_DONE;
                if (i == at && fault == 1) chunk(&transfer, KILO_PAGE, i);
            }
            // Chunk 0 again at once does not harm; the last one again comes too late to.
            const bool harmless = (fault == 1 && (at == 0 || at == 21)) || (fault == 2 && at == 21);
            assert_int_equal(done, harmless);
        }
}

TEST(a_first_chunk_in_the_middle_of_a_page_spoils_it) {
    transfer_t transfer = fresh();
    send(&transfer, KILO_SIZE, 0, 1);
    send(&transfer, KILO_NUMBER, 0, 0);
    for (uint8_t i = 0; i < 9; i++) chunk(&transfer, KILO_PAGE, i);
    assert_int_equal(chunk(&transfer, KILO_PAGE, 0), TRANSFER_REFUSED);
    send(&transfer, KILO_NUMBER, 0, 0);
    chunk(&transfer, KILO_PAGE, 5);
    assert_int_equal(chunk(&transfer, KILO_PAGE, 0), TRANSFER_REFUSED);
}

TEST(each_page_of_the_modules_own_program_counts_once_by_old_numbers_and_new) {
    for (uint8_t old = 0; old < 2; old++) {
        const uint8_t offset = old ? OLD : 0;
        transfer_t transfer = fresh();
        assert_int_equal(transfer_own_pages_missing(&transfer), 0);
        send(&transfer, (uint8_t)(OWN_SIZE + offset), 0, 3);
        assert_int_equal(transfer_own_pages_missing(&transfer), 3);
        for (uint8_t lap = 0; lap < 2; lap++)
            for (uint8_t page = 0; page < 3; page++) {
                assert_int_equal(send(&transfer, (uint8_t)(OWN_NUMBER + offset), 0, page),
                                 TRANSFER_GOES_ON);
                take_page(&transfer, (uint8_t)(OWN_PAGE - KILO_PAGE + offset),
                          lap == 0 ? TRANSFER_OWN_PAGE_DONE : TRANSFER_GOES_ON);
                assert_bytes(transfer.own.data, 128);
                assert_int_equal(transfer_own_pages_missing(&transfer), lap == 0 ? 2 - page : 0);
            }
    }
}

TEST(a_page_of_the_module_that_lost_a_chunk_comes_in_with_the_next_lap) {
    transfer_t transfer = fresh();
    send(&transfer, OWN_SIZE, 0, 1);
    send(&transfer, OWN_NUMBER, 0, 0);
    for (uint8_t i = 0; i < 22; i++)
        if (i != 7) assert_int_not_equal(chunk(&transfer, OWN_PAGE, i), TRANSFER_OWN_PAGE_DONE);
    // A chunk that comes twice does not stand in for the one that was lost.
    chunk(&transfer, OWN_PAGE, 8);
    assert_int_equal(transfer_own_pages_missing(&transfer), 1);
    send(&transfer, OWN_NUMBER, 0, 0);
    take_page(&transfer, OWN_PAGE - KILO_PAGE, TRANSFER_OWN_PAGE_DONE);
    assert_int_equal(transfer_own_pages_missing(&transfer), 0);
}

TEST(the_two_programs_do_not_disturb_one_another) {
    transfer_t transfer = fresh();
    send(&transfer, OWN_SIZE, 0, 1);
    send(&transfer, KILO_SIZE, 0, 1);
    send(&transfer, OWN_NUMBER, 0, 0);
    send(&transfer, KILO_NUMBER, 0, 0);
    for (uint8_t i = 0; i < 21; i++) {
        assert_int_equal(chunk(&transfer, OWN_PAGE, i), TRANSFER_GOES_ON);
        assert_int_equal(chunk(&transfer, KILO_PAGE, i), TRANSFER_GOES_ON);
    }
    assert_int_equal(chunk(&transfer, OWN_PAGE, 21), TRANSFER_OWN_PAGE_DONE);
    assert_int_equal(chunk(&transfer, KILO_PAGE, 21), TRANSFER_PAGE_DONE);
}

TEST(what_is_too_short_is_counted_and_changes_nothing) {
    const uint8_t types[] = {FORWARD_IR,  KILO_PAGE,      KILO_SIZE,      KILO_NUMBER,
                             OWN_PAGE,    OWN_SIZE,       OWN_NUMBER,     CONFIG,
                             CONFIG_SIZE, OWN_PAGE + OLD, OLD + OWN_SIZE, OLD + OWN_NUMBER};
    const uint8_t least[] = {8, 8, 3, 3, 8, 3, 3, 8, 3, 8, 3, 3};
    for (uint8_t i = 0; i < sizeof types; i++)
        for (uint8_t length = 0; length <= 8; length++) {
            transfer_t transfer = fresh(), before;
            send(&transfer, KILO_SIZE, 0, 9);
            send(&transfer, OWN_SIZE, 0, 9);
            const uint8_t data[8] = {types[i], 0, 1, 2, 3, 4, 5, 6};
            memcpy(&before, &transfer, sizeof before);
            transfer_receive(&transfer, data, length);
            assert_int_equal(transfer.dropped.too_short, length < least[i]);
            before.dropped = transfer.dropped;
            if (length < least[i]) assert_memory_equal(&before, &transfer, sizeof before);
        }
}

TEST(other_frames_are_left_to_the_module) {
    transfer_t transfer = fresh();
    for (uint16_t type = 0; type <= 255; type++) {
        const uint8_t low = (uint8_t)(type >= 0xA6 && type <= 0xA8 ? type - OLD : type);
        const bool mine = low == 1 || (low >= 3 && low <= 5) || (low >= 7 && low <= 9) ||
                          low == 0x0F || low == 0x10;
        const transfer_event_t event = send(&transfer, (uint8_t)type, 0, 1);
        assert_int_equal(event != TRANSFER_NOT_MINE, mine);
    }
}

TEST(counters_stay_at_their_end) {
    transfer_t transfer = fresh();
    for (uint32_t i = 0; i < 70000; i++) {
        transfer_receive(&transfer, NULL, 0);
        send(&transfer, CONFIG_SIZE, 0, 49);
        chunk(&transfer, CONFIG, 0);
    }
    assert_counted(&transfer, 65535, 65535, 65535);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_configuration_of_any_length_comes_in_as_many_chunks_as_it_needs),
        cmocka_unit_test(a_configuration_of_no_or_too_many_bytes_is_refused_and_leaves_the_old_one),
        cmocka_unit_test(
            the_chunks_of_a_refused_configuration_do_not_become_part_of_the_one_before),
        cmocka_unit_test(a_configuration_without_its_size_is_dropped),
        cmocka_unit_test(a_configuration_that_loses_or_repeats_or_swaps_a_chunk_is_dropped_whole),
        cmocka_unit_test(an_abandoned_configuration_does_not_go_on),
        cmocka_unit_test(an_infrared_message_comes_in_two_frames),
        cmocka_unit_test(half_an_infrared_message_is_none),
        cmocka_unit_test(the_pages_of_a_robots_program_come_round_and_round),
        cmocka_unit_test(a_check_holds_for_the_next_number_of_pages_and_for_no_other),
        cmocka_unit_test(a_part_of_an_announcement_that_cannot_be_is_refused),
        cmocka_unit_test(a_page_that_cannot_be_is_refused_with_its_chunks),
        cmocka_unit_test(a_page_without_its_number_is_dropped_whatever_was_in_memory),
        cmocka_unit_test(a_page_that_loses_repeats_or_swaps_a_chunk_is_dropped),
        cmocka_unit_test(a_first_chunk_in_the_middle_of_a_page_spoils_it),
        cmocka_unit_test(each_page_of_the_modules_own_program_counts_once_by_old_numbers_and_new),
        cmocka_unit_test(a_page_of_the_module_that_lost_a_chunk_comes_in_with_the_next_lap),
        cmocka_unit_test(the_two_programs_do_not_disturb_one_another),
        cmocka_unit_test(what_is_too_short_is_counted_and_changes_nothing),
        cmocka_unit_test(other_frames_are_left_to_the_module),
        cmocka_unit_test(counters_stay_at_their_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
