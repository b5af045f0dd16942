// Self-programming of the chip, by programs/self_programming.c in the boot section.
#include <doctest/doctest.h>

#include "avr/boards/robot_board.h"
#include "base/chance.h"

using namespace kilotwin;

namespace test_self_programming {

namespace {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
constexpr int BUSY = 1 << 6, ERASING = 1 << 1 | 1 << 0;

struct Bench {
    // Below the loader is code that it would slide into.
    Bench() {
        board.start_at_boot_section();
        board.run(100 * MS);
    }
    int byte(const std::string &name) const { return board.read(*image->symbol(name)); }
    int word(const std::string &name) const {
        return byte(name) | board.read(static_cast<uint16_t>(*image->symbol(name) + 1)) << 8;
    }
    int flash(int address) const {
        return board.flash(static_cast<uint16_t>(address)) |
               board.flash(static_cast<uint16_t>(address + 1)) << 8;
    }

    Chance chance{1};
    std::shared_ptr<const FlashImage> image = FlashImage::load(PROGRAMS "/self_programming.elf");
    RobotBoard board{*image, 3, {TICK_CYCLES, 7, 1, 2, 3, 4, InfraredGains()}, 0, chance};
};

}  // namespace

TEST_CASE("a write without an erase clears bits and keeps the others") {
    Bench bench;
    REQUIRE(bench.byte("done") == 1);
    CHECK(bench.word("both_writes") == (0xF0FF & 0x3CFF));
    CHECK(bench.word("unwritten_word") == 0x1234);
}

TEST_CASE("a word of the page's buffer keeps its first value until the page is written") {
    CHECK(Bench().word("first_fill") == 0x1111);
}

TEST_CASE("SPM does nothing below the boot section, or later than four cycles after its order") {
    Bench bench;
    CHECK(bench.word("from_below") == 0x5555);
    CHECK(bench.word("too_late") == 0xFFFF);
}

TEST_CASE("an erase and a write take 4 ms, in which the program runs on") {
    Bench bench;
    for (const char *operation : {"erase_cycles", "write_cycles"}) {
        CHECK(bench.word(operation) > 31'900);
        CHECK(bench.word(operation) <= 32'010);
    }
    // Four writes and an erase; the order that came too late is none.
    CHECK(bench.board.flash_operations() == 5);
}

TEST_CASE("while flash is programmed, and until it is enabled again, it cannot be read") {
    Bench bench;
    CHECK(bench.byte("busy_bits") == (BUSY | ERASING));
    CHECK(bench.byte("idle_bits") == BUSY);
    CHECK(bench.word("while_busy") == 0xFFFF);
    CHECK(bench.word("while_not_enabled") == 0xFFFF);
    CHECK(bench.word("after_enable") == (0xF0FF & 0x3CFF));
    CHECK(bench.flash(0x4200) == 0xFFFF);
    CHECK(bench.flash(0x4000) == (0xF0FF & 0x3CFF));
}

}  // namespace test_self_programming
