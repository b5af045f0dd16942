// The LED driver, byte by byte as its bus's master sees it.
#include <doctest/doctest.h>

#include <initializer_list>

#include "avr/boards/pca9635.h"

using namespace kilotwin;

namespace test_pca9635 {

namespace {

constexpr uint8_t ADDRESS = 0x15, AI_ALL = 4 << 5, AI_PWM = 5 << 5, AI_GROUP = 6 << 5;

/// Writes to it; whether it acknowledged everything.
bool tell(Pca9635 &chip, std::initializer_list<uint8_t> bytes, uint8_t address = ADDRESS << 1) {
    bool ack = chip.address(address);
    for (uint8_t byte : bytes) ack = ack && chip.write(byte);
    chip.stop();
    return ack;
}

/// Awake, all outputs by their PWM.
void wake(Pca9635 &chip) {
    REQUIRE(tell(chip, {AI_ALL | 0x00, 0x01, 0x04}));
    REQUIRE(tell(chip, {AI_ALL | 0x14, 0xAA, 0xAA, 0xAA, 0xAA}));
}

}  // namespace

TEST_CASE("it comes up asleep and dark, and answers to its address and the call to all") {
    Pca9635 chip(ADDRESS);
    CHECK(chip.light(0) == 0);
    CHECK_FALSE(tell(chip, {}, 0x16 << 1));
    CHECK_FALSE(tell(chip, {}, 0xE2));
    CHECK(tell(chip, {0x02, 9}, 0xE0));
    REQUIRE(tell(chip, {0x00}));
    REQUIRE(chip.address(ADDRESS << 1 | 1));
    CHECK(chip.read() == 0x11);
    tell(chip, {0x02});
    chip.address(ADDRESS << 1 | 1);
    CHECK(chip.read() == 9);
    // Sub-address 1, and no call to all.
    REQUIRE(tell(chip, {0x00, 0x08}));
    CHECK(tell(chip, {}, 0xE2));
    CHECK_FALSE(tell(chip, {}, 0xE0));
}

TEST_CASE("an LED shows what its PWM register and its mode say") {
    Pca9635 chip(ADDRESS);
    wake(chip);
    REQUIRE(tell(chip, {AI_PWM | 0x02, 10, 20, 30}));
    CHECK(chip.light(0) == 10);
    CHECK(chip.light(1) == 20);
    CHECK(chip.light(2) == 30);
    CHECK(chip.light(3) == 0);
    REQUIRE(tell(chip, {0x14, 0xE4}));  // off, fully on, by PWM, by PWM and group
    CHECK(chip.light(0) == 0);
    CHECK(chip.light(1) == 255);
    CHECK(chip.light(2) == 30);
    REQUIRE(tell(chip, {0x05, 200}));
    CHECK(chip.light(3) == 200);
    REQUIRE(tell(chip, {AI_GROUP | 0x12, 51, 0}));
    CHECK(chip.light(3) == 40);
    REQUIRE(tell(chip, {0x00, 0x11}));  // asleep
    CHECK(chip.light(1) == 255);
    CHECK(chip.light(2) == 0);
}

TEST_CASE("registers follow one another as the control register says") {
    Pca9635 chip(ADDRESS);
    wake(chip);
    REQUIRE(tell(chip, {0x02, 1, 2, 3}));  // no increment: the last counts
    CHECK(chip.light(0) == 3);
    CHECK(chip.light(1) == 0);
    REQUIRE(tell(chip, {AI_PWM | 0x10, 4, 5, 6}));  // outputs 14, 15, and 0 again
    CHECK(chip.light(14) == 4);
    CHECK(chip.light(15) == 5);
    CHECK(chip.light(0) == 6);
    REQUIRE(tell(chip, {AI_ALL | 0x1B, 0xE0, 0x01}));  // behind the last comes the first
    REQUIRE(tell(chip, {0x00}));
    REQUIRE(chip.address(ADDRESS << 1 | 1));
    CHECK((chip.read() & 0x1F) == 0x01);
    CHECK_FALSE(tell(chip, {0x1D, 0}));
}

TEST_CASE("the reset call takes it back to where it came up") {
    Pca9635 chip(ADDRESS);
    wake(chip);
    REQUIRE(tell(chip, {0x02, 99}));
    CHECK_FALSE(tell(chip, {0xA5, 0x5B}, 0x06));
    CHECK(chip.light(0) == 99);
    CHECK(tell(chip, {0xA5, 0x5A}, 0x06));
    CHECK(chip.light(0) == 0);
}

}  // namespace test_pca9635
