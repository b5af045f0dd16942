#include <doctest/doctest.h>

#include <random>

#include "grid/can_bus.h"

using namespace kilotwin;

namespace test_can_frame {

namespace {

/// Bit by bit, as the standard says it: the checksum's register of 15 bits.
uint16_t crc_of(const std::vector<bool> &bits) {
    uint16_t crc = 0;
    for (bool bit : bits) {
        bool carry = (crc >> 14 & 1) != bit;
        crc = static_cast<uint16_t>(crc << 1 & 0x7FFF);
        if (carry) crc ^= 0x4599;
    }
    return crc;
}

void append(std::vector<bool> &bits, uint32_t value, int count) {
    for (int bit = count - 1; bit >= 0; bit--) bits.push_back(value >> bit & 1);
}

std::vector<bool> header_and_data(const CanFrame &frame) {
    std::vector<bool> bits = {false};
    append(bits, frame.id, 11);
    append(bits, frame.rtr, 1);
    append(bits, 0, 2);
    append(bits, frame.dlc, 4);
    for (size_t i = 0; i < frame.dlc && !frame.rtr; i++) append(bits, frame.data[i], 8);
    return bits;
}

/// The frame on the wire, bit by bit.
std::vector<bool> wire_of(const CanFrame &frame) {
    std::vector<bool> bits = header_and_data(frame), wire;
    append(bits, crc_of(bits), 15);
    size_t run = 0;
    for (bool bit : bits) {
        run = wire.empty() || wire.back() != bit ? 1 : run + 1;
        wire.push_back(bit);
        if (run == 5) {
            wire.push_back(!bit);
            run = 1;
        }
    }
    wire.insert(wire.end(), {true, false});  // checksum's delimiter, acknowledgement
    wire.insert(wire.end(), 8, true);        // its delimiter, end of frame
    return wire;
}

}  // namespace

TEST_CASE("the checksum is CRC-15/CAN") {
    std::vector<bool> bits;
    for (char digit : std::string("123456789")) append(bits, static_cast<uint8_t>(digit), 8);
    CHECK(crc_of(bits) == 0x059E);  // the catalogue's check value
    std::mt19937 random(1);
    for (int i = 0; i < 2000; i++) {
        CanFrame frame = {static_cast<uint16_t>(random() & 0x7FF), static_cast<uint8_t>(i % 9)};
        for (auto &byte : frame.data) byte = static_cast<uint8_t>(random());
        CHECK(can_crc15(frame) == crc_of(header_and_data(frame)));
    }
}

TEST_CASE("a frame has the length that its stuff bits give it") {
    // 34 zeros: a stuff bit behind each five of them.
    CHECK(can_frame_bits({0, 0}) == 34 + 6 + 10);
    // Nothing in a row longer than four: header 0 10101010101 000 0001, data 0x55, checksum.
    CanFrame alternating = {0x555, 1, false, {0x55}};
    CHECK(can_crc15(alternating) == crc_of(header_and_data(alternating)));
    CHECK(can_frame_bits(alternating) == wire_of(alternating).size());
    std::mt19937 random(2);
    uint32_t least = 1000, most = 0;
    for (int i = 0; i < 20000; i++) {
        CanFrame frame = {static_cast<uint16_t>(random() & 0x7FF), static_cast<uint8_t>(i % 9)};
        frame.rtr = i % 100 == 0;
        // Bytes of long runs, as worst cases have them, among others.
        for (auto &byte : frame.data)
            byte = static_cast<uint8_t>(i % 3 == 0 ? random() : random() % 2 * 0xFF);
        uint32_t bits = can_frame_bits(frame), plain = 44 + 8u * (frame.rtr ? 0 : frame.dlc);
        REQUIRE(bits == wire_of(frame).size());
        REQUIRE(bits <= plain + (plain - 11) / 4);
        REQUIRE(bits >= plain);
        least = std::min(least, bits);
        most = std::max(most, bits);
    }
    CHECK(least < 48);
    CHECK(most > 120);
}

TEST_CASE("the longest frame has 24 stuff bits") {
    // The first run of five ones and every four bits another, right into the checksum.
    uint32_t most = 0;
    for (uint32_t id = 0; id < 0x800; id++)
        for (uint8_t byte : {0x0F, 0x1E, 0x3C, 0x78, 0xF0, 0xE1, 0xC3, 0x87}) {
            CanFrame frame = {static_cast<uint16_t>(id), 8};
            frame.data.fill(byte);
            most = std::max(most, can_frame_bits(frame));
        }
    CHECK(most <= 108 + 24);
    CHECK(most >= 108 + 20);
}

}  // namespace test_can_frame
