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

/// Memory of nobody, for accesses that an AVR does not stop at: it reads as zeros, and what is
/// written is lost. What they would meet on the robot is known to its linker only.
class LostMemory {
  public:
    /// Whether the robot has memory at that address, taken as a number: its registers, and RAM up
    /// to 0x8FF.
    static bool is_the_robots(const void *address);

    /// Makes the instruction at RIP, whose access to `address` failed, meet this memory, and has
    /// the processor stop after it: then comes SIGTRAP, and settle(). False: the instruction is not
    /// of a kind that can be led elsewhere, as one that has its address from no register.
    bool redirect(greg_t *registers, const void *address);

    /// After that instruction: its pointer is what it was. False: there was none.
    bool settle(greg_t *registers);

  private:
    static constexpr size_t RAM_END = 0x900;
    static constexpr size_t WIDEST_ACCESS = 64;

    alignas(64) std::array<uint8_t, 2 *WIDEST_ACCESS> memory_ = {};
    int redirected_ = -1;  ///< index of the register, -1: none
    greg_t original_ = 0, replaced_ = 0;
};

}  // namespace kilotwin

#endif
