/// What stops a program on this PC but not on an AVR, put right so that it goes on as there.
///
/// An AVR divides by zero without a word, and everything below 0x900 is memory to it, so programs
/// live for years with a division by zero or a pointer that is NULL. Both functions are called by
/// the handler of the fault, with the registers of the instruction that caused it.
#ifndef KILOTWIN_GUEST_FIXUPS_H
#define KILOTWIN_GUEST_FIXUPS_H

#include <ucontext.h>

#include <array>
#include <cstdint>

namespace kilotwin {

/// Gives the division at RIP the result that avr-gcc's library has, and goes on after it: by zero,
/// a quotient with all bits set (its sign turned if the dividend is negative) and the dividend as
/// remainder; of the least number by -1, that number and 0. False: it is no division.
bool divide_as_avr(greg_t *registers);

/// The robot's data memory (registers, and RAM up to 0x8FF) where a program reaches it by a pointer
/// that belongs to no variable of its own. It reads as zeros, and what is written is lost: which
/// variable would lie there is known to the robot's linker only.
class LowMemory {
  public:
    /// Whether the robot has memory there. Address 0 itself is left out: what NULL points to is
    /// nobody's variable.
    static bool has(const void *address);

    /// Makes the instruction at RIP, which the fault came from, reach memory of its own instead,
    /// and has the processor stop after it: then comes SIGTRAP, and settle(). False: the
    /// instruction is not of a kind that can be led elsewhere.
    bool redirect(greg_t *registers);

    /// After that instruction: its pointer is what it was. False: there was none.
    bool settle(greg_t *registers);

  private:
    static constexpr size_t BYTES = 0x900;
    static constexpr size_t MARGIN = 64;  ///< the widest access

    alignas(64) std::array<uint8_t, BYTES + MARGIN> memory_ = {};
    int redirected_ = -1;  ///< index of the register, -1: none
    greg_t original_ = 0, replaced_ = 0;
};

}  // namespace kilotwin

#endif
