/// A classic CAN frame with an 11-bit identifier, as everything on the Kilogrid's buses is.
#ifndef KILOTWIN_BASE_CAN_FRAME_H
#define KILOTWIN_BASE_CAN_FRAME_H

#include <array>
#include <cstddef>
#include <cstdint>

namespace kilotwin {

struct CanFrame {
    static constexpr uint16_t ID_MAX = 0x7FF;
    static constexpr size_t DATA_MAX = 8;

    uint16_t id = 0;   ///< 0 to ID_MAX: an address, see kilogrid_modules/protocol/address.h
    uint8_t dlc = 0;   ///< data bytes, 0 to DATA_MAX; a remote frame asks for as many
    bool rtr = false;  ///< a remote frame: carries no data, and nobody here sends one
    std::array<uint8_t, DATA_MAX> data{};  ///< what is beyond dlc is zero

    bool operator==(const CanFrame &) const = default;
};

/// A frame that ended on a bus, as Python has it: a row of a numpy array, without gaps.
#pragma pack(push, 1)
struct CanRecord {
    double at_s;  ///< when its last bit ended
    uint8_t bus;
    uint16_t id;
    uint8_t dlc;
    std::array<uint8_t, CanFrame::DATA_MAX> data;
    uint8_t from_host;  ///< 1: the host sent it; 0: a module
};
#pragma pack(pop)
static_assert(sizeof(CanRecord) == 21);

}  // namespace kilotwin

#endif
