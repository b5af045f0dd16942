/// Tiers: the ways in which a robot's program is executed.
#ifndef KILOTWIN_ROBOTS_TIER_H
#define KILOTWIN_ROBOTS_TIER_H

#include <cstdint>

namespace kilotwin {

/// One word from the experiment to the engine (`swarm.cpu`, `engine.avr_core`).
enum class Tier : uint8_t {
    NATIVE,       ///< its C source, compiled for this computer
    TRANSLATED,   ///< its machine code, made code of this computer; the engine plays peripherals
    CHIP,         ///< its machine code on an ATmega328P; translated, if a C compiler is here
    INTERPRETED,  ///< the same, instruction by instruction
};

/// Whether the program runs on a board with a simulated chip.
constexpr bool is_on_board(Tier tier) { return tier == Tier::CHIP || tier == Tier::INTERPRETED; }

}  // namespace kilotwin

#endif
