// The chip as a programmer on its SPI sees it, instruction by instruction.
#include <doctest/doctest.h>

#include "avr/chip/serial_programming.h"

using namespace kilotwin;

namespace test_serial_programming {

namespace {

using Bytes = SerialProgramming::Bytes;
constexpr Bytes ENABLE = {0xAC, 0x53, 0, 0}, ERASE = {0xAC, 0x80, 0, 0};

/// A chip and its SPI, enabled.
struct Chip {
    ChipMemory memory;
    SerialProgramming spi{memory};
    Chip() { spi.shift(ENABLE); }
    uint8_t last(const Bytes &instruction) { return spi.shift(instruction)[3]; }
};

}  // namespace

TEST_CASE("before it is enabled nothing is read, written or erased") {
    ChipMemory memory;
    memory.flash[0] = 0x12;
    SerialProgramming spi(memory);
    CHECK_FALSE(spi.enabled());
    CHECK(spi.shift({0x20, 0, 0, 0}) == Bytes{});
    CHECK(spi.shift(ERASE) == Bytes{});
    CHECK(memory.flash[0] == 0x12);
    CHECK(spi.shift(ENABLE) == Bytes{0, 0xAC, 0x53, 0});
    CHECK(spi.enabled());
    CHECK(spi.shift({0x20, 0, 0, 0})[3] == 0x12);
    spi.reset();
    CHECK_FALSE(spi.enabled());
}

TEST_CASE("fuses decide whether it can be programmed by its SPI") {
    ChipMemory memory;
    SerialProgramming spi(memory);
    memory.high_fuse = 0xD1 | 1 << 5;  // SPIEN off
    spi.shift(ENABLE);
    CHECK_FALSE(spi.enabled());
    memory.high_fuse = 0xD1 & 0x7F;  // RSTDISBL on
    spi.shift(ENABLE);
    CHECK_FALSE(spi.enabled());
    memory.high_fuse = 0xD1;
    spi.shift(ENABLE);
    CHECK(spi.enabled());
}

TEST_CASE("what comes out echoes the byte before, and the last byte is what is read") {
    Chip chip;
    chip.memory.signature = {0x1E, 0x95, 0x0F};
    CHECK(chip.spi.shift({0x30, 7, 1, 9}) == Bytes{0, 0x30, 7, 0x95});
    CHECK(chip.last({0x30, 0, 0, 0}) == 0x1E);
    CHECK(chip.last({0x30, 0, 2, 0}) == 0x0F);
    CHECK(chip.last({0x30, 0, 3, 0}) == 0xFF);
    CHECK(chip.last({0x38, 0, 0, 0}) == chip.memory.calibration);
    CHECK(chip.last({0xF0, 0, 0, 0}) == 0);
    CHECK(chip.spi.shift({0x99, 1, 2, 3}) == Bytes{0, 0x99, 1, 2});  // no instruction
    CHECK(chip.last({0x4D, 0, 5, 0}) == 5);                          // of larger chips
}

TEST_CASE("a flash page is loaded, written where the address says, and bits only fall") {
    Chip chip;
    chip.spi.shift({0x40, 0, 3, 0x34});
    chip.spi.shift({0x48, 0, 3, 0x12});
    chip.spi.shift({0x4C, 0x38, 0x3F, 0});  // any word of the page at 0x7000
    CHECK(chip.memory.flash[0x7006] == 0x34);
    CHECK(chip.memory.flash[0x7007] == 0x12);
    CHECK(chip.last({0x20, 0x38, 3, 0}) == 0x34);
    CHECK(chip.last({0x28, 0x38, 3, 0}) == 0x12);
    chip.spi.shift({0x40, 0, 3, 0xF1});
    chip.spi.shift({0x4C, 0x38, 0, 0});
    CHECK(chip.memory.flash[0x7006] == (0x34 & 0xF1));
    CHECK(chip.memory.flash[0x7007] == 0x12);  // the buffer had been erased by the write before
}

TEST_CASE("the eeprom is written by bytes, or by pages of which only loaded bytes change") {
    Chip chip;
    chip.spi.shift({0xC0, 0x03, 0xFE, 0x42});
    CHECK(chip.memory.eeprom[0x3FE] == 0x42);
    CHECK(chip.last({0xA0, 0x03, 0xFE, 0}) == 0x42);
    chip.spi.shift({0xC1, 0, 1, 0x55});
    chip.spi.shift({0xC2, 0x03, 0xFC, 0});
    CHECK(chip.memory.eeprom[0x3FD] == 0x55);
    CHECK(chip.memory.eeprom[0x3FE] == 0x42);
    chip.spi.shift({0xC2, 0x00, 0x00, 0});  // nothing is loaded any more
    CHECK(chip.memory.eeprom[1] == 0xFF);
}

TEST_CASE("erasing the chip keeps the eeprom only with the fuse EESAVE") {
    for (const bool kept : {true, false}) {
        Chip chip;
        chip.memory.high_fuse = kept ? 0xD1 : 0xD9;
        chip.memory.flash[100] = chip.memory.eeprom[100] = 7;
        chip.memory.lock_bits = 0xC0;
        chip.spi.shift(ERASE);
        CHECK(chip.memory.flash[100] == 0xFF);
        CHECK(chip.memory.eeprom[100] == (kept ? 7 : 0xFF));
        CHECK(chip.memory.lock_bits == 0xFF);
    }
}

TEST_CASE("fuses are written both ways, except SPIEN, and lock bits only fall") {
    Chip chip;
    chip.spi.shift({0xAC, 0xA0, 0, 0x62});
    chip.spi.shift({0xAC, 0xA8, 0, 0xFE});
    chip.spi.shift({0xAC, 0xA4, 0, 0x05});
    chip.spi.shift({0xAC, 0x11, 0, 0x00});  // no such fuse
    CHECK(chip.last({0x50, 0x00, 0, 0}) == 0x62);
    CHECK(chip.last({0x58, 0x08, 0, 0}) == (0xFE & ~0x20));
    CHECK(chip.last({0x50, 0x08, 0, 0}) == 0xFD);
    chip.spi.shift({0xAC, 0xE0, 0, 0x2F});
    CHECK(chip.last({0x58, 0x00, 0, 0}) == 0xEF);
    chip.spi.shift({0xAC, 0xE0, 0, 0xFF});
    CHECK(chip.last({0x58, 0x00, 0, 0}) == 0xEF);
}

TEST_CASE("lock bits forbid writing in mode 2, and reading too in mode 3") {
    Chip chip;
    chip.memory.flash[0] = chip.memory.flash[1] = chip.memory.eeprom[0] = 7;
    auto write_all = [&] {
        chip.spi.shift({0x40, 0, 0, 0});
        chip.spi.shift({0x4C, 0, 0, 0});
        chip.spi.shift({0xC0, 0, 0, 0});
        chip.spi.shift({0xC1, 0, 0, 0});
        chip.spi.shift({0xC2, 0, 0, 0});
        chip.spi.shift({0xAC, 0xA0, 0, 0});
    };
    chip.memory.lock_bits = 0xFE;
    write_all();
    CHECK(chip.last({0x20, 0, 0, 0}) == 7);
    CHECK(chip.last({0x28, 0, 0, 0}) == 7);
    CHECK(chip.last({0xA0, 0, 0, 0}) == 7);
    CHECK(chip.memory.low_fuse == 0xE2);
    chip.memory.lock_bits = 0xFC;
    write_all();
    CHECK(chip.last({0x20, 0, 0, 0}) == 0xFF);
    CHECK(chip.last({0x28, 0, 0, 0}) == 0xFF);
    CHECK(chip.last({0xA0, 0, 0, 0}) == 0xFF);
    CHECK(chip.memory.flash[0] == 7);
    CHECK(chip.memory.eeprom[0] == 7);
}

}  // namespace test_serial_programming
