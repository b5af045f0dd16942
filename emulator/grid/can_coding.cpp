#include "grid/can_coding.h"

namespace kilotwin {

namespace {

constexpr uint32_t HEADER_BITS = 19;
constexpr uint32_t CRC_BITS = 15;
// Behind the checksum: its delimiter, acknowledge slot and delimiter, end of frame. Not stuffed.
constexpr uint32_t TRAILER_BITS = 1 + 1 + 1 + 7;
constexpr uint16_t CRC_POLYNOMIAL = 0x4599;

/// Checksums of all bytes, so that a frame needs no loop over its bits.
struct CrcTable {
    uint16_t of[256] = {};
    constexpr CrcTable() {
        for (uint32_t byte = 0; byte < 256; byte++) {
            uint32_t crc = byte << (CRC_BITS - 8);
            for (int bit = 0; bit < 8; bit++)
                crc = (crc & 0x4000) != 0 ? crc << 1 ^ CRC_POLYNOMIAL : crc << 1;
            of[byte] = crc & 0x7FFF;
        }
    }
};
constexpr CrcTable CRC;

/// Bit stuffing as a state machine that takes a byte a step. A state is the last bit on the wire
/// and the length of the run of equal bits that it ends: runs of 1 to 5 zeros are states 0 to 4,
/// runs of ones 5 to 9.
struct StuffTable {
    static constexpr uint32_t STATES = 10, RUN_MAX = 5;
    uint8_t next[STATES][256] = {};
    uint8_t stuffed[STATES][256] = {};

    static constexpr uint32_t state_of(uint32_t bit, uint32_t run) {
        return bit * RUN_MAX + run - 1;
    }

    /// The state after `bit`. Adds 1 to `count` if a stuff bit goes ahead of it.
    static constexpr uint32_t after(uint32_t state, uint32_t bit, uint32_t &count) {
        uint32_t last = state / RUN_MAX, run = state % RUN_MAX + 1;
        if (run == RUN_MAX) {
            count++;
            last = 1 - last;
            run = 1;
        }
        return bit == last ? state_of(bit, run + 1) : state_of(bit, 1);
    }

    constexpr StuffTable() {
        for (uint32_t state = 0; state < STATES; state++)
            for (uint32_t byte = 0; byte < 256; byte++) {
                uint32_t now = state, count = 0;
                for (int bit = 7; bit >= 0; bit--) now = after(now, byte >> bit & 1, count);
                next[state][byte] = static_cast<uint8_t>(now);
                stuffed[state][byte] = static_cast<uint8_t>(count);
            }
    }
};
constexpr StuffTable STUFF;

/// Start of frame (0), identifier, remote bit, two reserved bits, data length.
uint32_t header_of(const CanFrame &frame) {
    return static_cast<uint32_t>(frame.id) << 7 | static_cast<uint32_t>(frame.rtr) << 6 | frame.dlc;
}

size_t data_bytes(const CanFrame &frame) { return frame.rtr ? 0 : frame.dlc; }

uint16_t crc_step(uint16_t crc, uint8_t byte) {
    return static_cast<uint16_t>((crc << 8 & 0x7FFF) ^
                                 CRC.of[(crc >> (CRC_BITS - 8) ^ byte) & 0xFF]);
}

}  // namespace

uint16_t can_crc15(const CanFrame &frame) {
    // Leading zeros, which fill the 19 bits of header up to whole bytes, leave a checksum that
    // begins with 0 as it is.
    uint32_t header = header_of(frame);
    uint16_t crc = crc_step(0, static_cast<uint8_t>(header >> 16));
    crc = crc_step(crc, static_cast<uint8_t>(header >> 8));
    crc = crc_step(crc, static_cast<uint8_t>(header));
    for (size_t i = 0; i < data_bytes(frame); i++) crc = crc_step(crc, frame.data[i]);
    return crc;
}

uint32_t can_frame_bits(const CanFrame &frame) {
    uint32_t header = header_of(frame), stuffed = 0, state = STUFF.state_of(0, 1);
    auto take_bit = [&](uint32_t bit) { state = STUFF.after(state, bit, stuffed); };
    auto take = [&](uint32_t byte) {
        stuffed += STUFF.stuffed[state][byte];
        state = STUFF.next[state][byte];
    };
    // The start of frame is the first state; 18 bits of header remain.
    take_bit(header >> 17 & 1);
    take_bit(header >> 16 & 1);
    take(header >> 8 & 0xFF);
    take(header & 0xFF);
    for (size_t i = 0; i < data_bytes(frame); i++) take(frame.data[i]);
    uint16_t crc = can_crc15(frame);
    take(crc >> 7);
    for (int bit = 6; bit >= 0; bit--) take_bit(crc >> bit & 1);
    // Stuffing covers the whole checksum: a run of five that ends it gets a stuff bit too.
    if (state % StuffTable::RUN_MAX == StuffTable::RUN_MAX - 1) stuffed++;
    return HEADER_BITS + 8 * static_cast<uint32_t>(data_bytes(frame)) + CRC_BITS + stuffed +
           TRAILER_BITS;
}

}  // namespace kilotwin
