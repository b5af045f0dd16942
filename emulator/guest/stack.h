/// The one stack that all guests run on, in turn.
///
/// A call that comes back is an ordinary call. A call that blocks (`delay`) is suspended: the used
/// part of the stack is copied away and, later, back to the same address, so pointers into it stay
/// valid. The stack lies between guard pages; a fault in a guest ends its call and nothing else.
/// `for (;;);` has no basic block that clang would instrument: a timer finds a guest in such a
/// jump to itself.
#ifndef KILOTWIN_GUEST_STACK_H
#define KILOTWIN_GUEST_STACK_H

#include <cstddef>
#include <cstdint>
#include <vector>

#include "guest/fixups.h"

namespace kilotwin {

/// A call that blocked: the bytes of the stack from its lowest address to the top.
using SuspendedCall = std::vector<uint8_t>;

class GuestStack {
  public:
    enum class Outcome { RETURNED, SUSPENDED, ABANDONED, FAULT };

    /// How a fault happened, after Outcome::FAULT.
    struct Fault {
        int signal = 0;
        const void *address = nullptr;
        bool stack_overflow = false;
        bool jump_to_zero = false;  ///< the program was to go on at address 0
    };

    static constexpr size_t BYTES = 64 * 1024;

    /// Called on the guest's stack when the guest is found in an empty endless loop; must not
    /// return.
    using EmptyLoop = void (*)();

    /// What an AVR does not stop at, and a program here does not either (fixups.h).
    enum class Mistake { DIVISION_BY_ZERO, LOST_ACCESS };

    /// Called in the handler of the fault, from which nothing must be thrown; `address` is that of
    /// the memory. False: the program shall stop.
    using OnMistake = bool (*)(Mistake mistake, const void *address);

    /// The process's one stack; installs the signal handlers when first used.
    static GuestStack &instance();

    /// To be called by a thread before it runs guests: faults and the timer reach it from then on.
    void serve_this_thread();

    /// Who is told of what befalls guests from now on: robots and modules take turns.
    void attend(EmptyLoop empty_loop, OnMistake on_mistake) {
        empty_loop_ = empty_loop;
        on_mistake_ = on_mistake;
    }

    /// Runs `body(argument)` from the top of the stack. On SUSPENDED the call was moved into
    /// `suspended`.
    Outcome call(void (*body)(void *), void *argument, SuspendedCall &suspended);

    /// Goes on with a suspended call, which is consumed (and filled anew if it blocks again).
    Outcome resume(SuspendedCall &suspended);

    /// From within a guest's call: lets the caller of call() or resume() go on. Returns when
    /// resumed.
    void suspend();

    /// From within a guest's call: ends it; its frames are dropped.
    [[noreturn]] void abandon();

    const Fault &fault() const { return fault_; }

    /// Top of the stack: where the frames of a guest begin.
    const uint8_t *top() const { return memory_ + BYTES; }

  private:
    GuestStack();
    Outcome back(Outcome outcome, SuspendedCall &suspended);
    static void on_fault(int signal, void *info, void *context);
    bool overlook(int signal, const void *address, greg_t *registers);
    static void on_timer(void *context);
    [[noreturn]] static void leave_after_fault();

    uint8_t *memory_ = nullptr;
    void *host_ = nullptr;   ///< where the caller's stack was left; null while no guest runs
    void *guest_ = nullptr;  ///< and the guest's
    EmptyLoop empty_loop_ = nullptr;
    OnMistake on_mistake_ = nullptr;
    LostMemory lost_memory_;
    Fault fault_;

    friend struct StackEntry;
};

}  // namespace kilotwin

#endif
