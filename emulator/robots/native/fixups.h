/// Emulates, after a fault on this PC, what the same instruction does on an AVR, so that the
/// program goes on as there.
///
/// An AVR does not trap a division by zero, and every address below 0x900 is memory to it, so
/// programs run for years with a division by zero or a NULL pointer. The functions are called by
/// the signal handler of the fault, with the registers of the instruction that caused it, and only
/// for faults of guest code: they read the instruction at RIP. They neither allocate nor throw.
#ifndef KILOTWIN_ROBOTS_NATIVE_FIXUPS_H
#define KILOTWIN_ROBOTS_NATIVE_FIXUPS_H

#include <ucontext.h>

#include <array>
#include <cstdint>

namespace kilotwin {

/// The flag by which the processor traps after each instruction.
constexpr greg_t TRAP_FLAG = 1 << 8;

/// Gives the division at RIP the result of avr-gcc's library and moves RIP behind it. By zero: a
/// quotient with all bits set (negated if the dividend is negative), and the dividend as remainder.
/// The least number by -1: that number, and 0. False, with the registers untouched: it is no
/// division.
bool divide_as_avr(greg_t *registers);

/// Scratch memory for accesses that an AVR does not trap: it reads as zeros, and writes to it are
/// lost. What lies at these addresses on the robot, only the robot's linker knows.
class LostMemory {
  public:
    /// Whether `address`, as a number, is memory on the robot: registers, and RAM up to 0x8FF.
    static bool is_the_robots(const void *address);

    /// Redirects the instruction at RIP, whose access to `address` failed, to this memory, by
    /// changing the register that holds its address, and sets the trap flag: SIGTRAP follows the
    /// instruction, upon which settle() is due. False: the instruction cannot be redirected, since
    /// it takes its address from no register, or from the stack pointer.
    bool redirect(greg_t *registers, const void *address);

    /// Restores the register after the redirected instruction. False: there was none.
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
