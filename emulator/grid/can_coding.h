/// A CAN frame as bits on the wire: its checksum and its length with stuff bits (ISO 11898-1,
/// base frame format).
///
/// Pure functions of a frame, a table step per byte; frames need not be valid CAN of the Kilogrid.
#ifndef KILOTWIN_GRID_CAN_CODING_H
#define KILOTWIN_GRID_CAN_CODING_H

#include <cstdint>

#include "base/can_frame.h"

namespace kilotwin {

/// Bits of `frame` on the wire, stuff bits included, from the start of frame to the last bit of the
/// end of frame: 44 + 8 dlc, and 0 to (33 + 8 dlc) / 4 stuff bits. Without the intermission. A
/// remote frame has no data bits, whatever its dlc.
uint32_t can_frame_bits(const CanFrame &frame);

/// CRC-15 of a frame's header and data: polynomial 0x4599, from 0, highest bit first.
uint16_t can_crc15(const CanFrame &frame);

}  // namespace kilotwin

#endif
