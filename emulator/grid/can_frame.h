/// A CAN frame with an 11-bit identifier, as it is on the wire.
#ifndef KILOTWIN_GRID_CAN_FRAME_H
#define KILOTWIN_GRID_CAN_FRAME_H

#include <array>
#include <cstdint>

namespace kilotwin {

struct CanFrame {
    uint16_t id;  ///< 11 bits
    uint8_t dlc;  ///< data bytes, 0..8
    bool rtr = false;
    std::array<uint8_t, 8> data{};
};

}  // namespace kilotwin

#endif
