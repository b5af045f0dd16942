/// A classic CAN frame with an 11-bit identifier: every frame on the Kilogrid's buses is one.
#ifndef KILOTWIN_BASE_CAN_FRAME_H
#define KILOTWIN_BASE_CAN_FRAME_H

#include <array>
#include <cstddef>
#include <cstdint>

namespace kilotwin {

/// Plain data, 12 bytes; compares by content.
struct CanFrame {
    static constexpr uint16_t ID_MAX = 0x7FF;  ///< 11 bits
    static constexpr size_t DATA_MAX = 8;      ///< bytes

    uint16_t id = 0;   ///< 0 to ID_MAX: an address, see kilogrid_modules/protocol/address.h
    uint8_t dlc = 0;   ///< data bytes, 0 to DATA_MAX; a remote frame requests as many
    bool rtr = false;  ///< a remote frame, without data; no Kilogrid program sends one
    std::array<uint8_t, DATA_MAX> data{};  ///< bytes from dlc on are 0

    /// Equal in all fields.
    bool operator==(const CanFrame &) const = default;
};

/// A frame that ended on a bus, as a row of a numpy array: packed, in the order of CAN_RECORD
/// (python/bridge.cpp).
#pragma pack(push, 1)
struct CanRecord {
    double at_s;  ///< end of its last bit; 0: begin of the experiment
    uint8_t bus;  ///< index in the grid
    uint16_t id;
    uint8_t dlc;  ///< data bytes, 0 to 8
    std::array<uint8_t, CanFrame::DATA_MAX> data;
    uint8_t from_host;  ///< 1: the host sent it; 0: a module
};
#pragma pack(pop)
// The row of numpy's dtype has no gaps.
static_assert(sizeof(CanRecord) == 21);

}  // namespace kilotwin

#endif
