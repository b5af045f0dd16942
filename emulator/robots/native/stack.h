/// The stack that guests run on, in turn.
///
/// A call that returns is an ordinary call. A call that blocks (`delay`) is suspended: the used
/// part of the stack is copied out and, later, back to the same address, so that pointers into it
/// stay valid. The stack lies between guard pages; a fault in a guest ends its call and nothing
/// else. `for (;;);` has no basic block that clang would instrument: a timer of 5 ms CPU time finds
/// a guest in such a jump to itself. It also ends a call in which, for 5 s of CPU time, the guest's
/// clock stands still: loops that nothing counts, made of inline assembly or longjmp().
///
/// There is one for each share of the robots (base/team.h): a suspended call comes back to the
/// stack that it left, in whichever thread. One guest runs on it at a time.
#ifndef KILOTWIN_ROBOTS_NATIVE_STACK_H
#define KILOTWIN_ROBOTS_NATIVE_STACK_H

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "base/clock.h"
#include "base/events.h"
#include "robots/native/fixups.h"

namespace kilotwin {

/// A suspended call: the bytes of the stack from its lowest address to the top.
using SuspendedCall = std::vector<uint8_t>;

class GuestStack {
  public:
    /// How a call came back to the host: by return, suspend(), abandon(), or a fault.
    enum class Outcome { RETURNED, SUSPENDED, ABANDONED, FAULT };

    /// A CodePath as a signal handler can make it.
    struct Place {
        static constexpr size_t MOST = 16;
        std::array<uint32_t, MOST> code = {};
        size_t count = 0;
        CodePath path() const { return {code.begin(), code.begin() + count}; }
    };

    /// The last fault, after Outcome::FAULT.
    struct Fault {
        int signal = 0;
        const void *address = nullptr;  ///< of the memory, as the signal reports it
        bool stack_overflow = false;    ///< it lies in the guard pages below the stack
        bool jump_to_zero = false;      ///< the program counter was 0
        bool stuck = false;             ///< no fault: its clock stood still for too long
        int system_call = -1;           ///< which one it made, confined; -1: none
        Place place = {};
    };

    /// CPU time of one call within which the guest's clock has to advance, or the call to come
    /// back. What is counted (busy_watch.h) takes milliseconds for a tick.
    static constexpr int STUCK_CPU_S = 5;
    /// The same in seconds of the wall, for a guest that sleeps.
    static constexpr int STUCK_WALL_S = 10;

    /// Rounding, traps and flushing of the floating-point units. A guest that changes them finds
    /// them so again, and no one else does: they are kept per guest, by its clock.
    struct FloatControl {
        uint32_t sse;
        uint16_t x87;
        bool operator==(const FloatControl &) const = default;
    };

    static constexpr size_t BYTES = 64 * 1024;

    /// Called on the guest's stack when the guest is found in an empty endless loop; must not
    /// return.
    using EmptyLoop = void (*)();

    /// Accesses that an AVR does not trap, and that a program survives here too (fixups.h).
    enum class Mistake { DIVISION_BY_ZERO, LOST_ACCESS };

    /// Called in the signal handler, so it must not throw; `address` is that of the memory. False:
    /// the program has to stop.
    using OnMistake = bool (*)(Mistake mistake, const void *address);

    /// The stack of a share; the first call installs the signal handlers. To be called by one
    /// thread at a time; the stack stays for the life of the process.
    static GuestStack &of(uint32_t share);

    /// To be called by a thread before it runs guests: gives it a signal stack and the timer.
    static void prepare_this_thread();

    /// The same by the thread that steps the world, before guests run in any: closes a confined
    /// process to guests that are not loaded. Cheap when called again.
    static void serve_this_thread();

    /// To be called before the process confines itself (base/confinement.h): a system call that is
    /// refused then ends the call of the guest which makes it, and fails in the engine.
    static void attend_system_calls();

    /// Finds guests that sleep too, in this thread. Once; it interrupts a blocking call of the
    /// engine each second, which not all libraries bear.
    static void watch_sleep();

    /// To be called when the guest with this clock is gone.
    void forget(const volatile Cycles *clock) {
        if (!float_controls_.empty()) float_controls_.erase(clock);
    }

    /// Whether the guest with this clock has set floating-point units otherwise than the host.
    bool keeps_float_control(const volatile Cycles *clock) const {
        return !float_controls_.empty() && float_controls_.contains(clock);
    }

    /// Sets the handlers and the clock (its present moment) of the guest that runs from now on:
    /// robots and modules have their own.
    void set_guest(EmptyLoop empty_loop, OnMistake on_mistake, const volatile Cycles *clock) {
        empty_loop_ = empty_loop;
        on_mistake_ = on_mistake;
        clock_ = clock;
    }

    /// To be called when a guest is loaded: where its code lies, and address 0 of its file.
    static void add_code(uintptr_t begin, uintptr_t end, uintptr_t zero) {
        code_.push_back({begin, end, zero});
    }

    /// Runs `body(argument)` from the top of the stack. SUSPENDED: the call was moved into
    /// `suspended`.
    Outcome call(void (*body)(void *), void *argument, SuspendedCall &suspended);

    /// Resumes a suspended call, which is consumed, and filled anew if it blocks again.
    Outcome resume(SuspendedCall &suspended);

    /// From within a guest's call: returns to the caller of call() or resume(). Itself returns once
    /// resumed.
    void suspend();

    /// From within a guest's call: ends it for good; its frames are dropped.
    [[noreturn]] void abandon();

    const Fault &fault() const { return fault_; }

    /// Where the guest was when the last signal came, as for EmptyLoop and OnMistake.
    CodePath place_of_signal() const { return place(signal_at_, signal_sp_).path(); }

    /// Where the guest called the function of the engine whose __builtin_frame_address(0) this is.
    CodePath place_of_call(const void *frame) const;

    /// The same of a call of kt_host_t.spent: the loop that the guest goes round.
    CodePath place_of_loop(const uint8_t *frame) const;

    /// Top of the stack: where the frames of a guest begin.
    const uint8_t *top() const { return memory_ + BYTES; }

  private:
    GuestStack();
    static void handle_signals();
    Outcome back(Outcome outcome, SuspendedCall &suspended);
    static void on_fault(int signal, void *info, void *context);
    bool survives(int signal, const void *address, greg_t *registers);
    static void on_timer(void *info, void *context);
    bool is_stuck(uintptr_t at, uint32_t weight);
    void take_float_control();
    void give_float_control();
    void end_call(greg_t *registers);
    struct Code;
    static const Code *guests_code(uintptr_t at);  ///< null: it is no guest's
    static bool is_guests_code(uintptr_t at) { return guests_code(at) != nullptr; }
    static bool returns_there(uintptr_t word);
    Place place(uintptr_t at, uintptr_t sp) const;
    void note_signal(const greg_t *registers);
    void refuse_system_call(greg_t *registers, const void *info);
    [[noreturn]] static void leave_after_fault();

    uint8_t *memory_ = nullptr;
    void *host_ = nullptr;   ///< the host's stack pointer; null while no guest runs
    void *guest_ = nullptr;  ///< stack pointer of the guest that was left
    SuspendedCall spare_;    ///< memory of the call resumed last, for the next one to suspend
    EmptyLoop empty_loop_ = nullptr;
    OnMistake on_mistake_ = nullptr;
    const volatile Cycles *clock_ = nullptr;  ///< of the guest that runs

    /// A guest's code, from the lowest address to behind the highest.
    struct Code {
        uintptr_t begin, end, zero;
    };
    inline static std::vector<Code> code_;  ///< of all guests; none is loaded while one runs

    /// The stack that this thread runs a guest on, or null: signals come to the thread. The model
    /// spares a call; it has room for some bytes in each process.
    inline static thread_local GuestStack *current_ __attribute__((tls_model("initial-exec"))) =
        nullptr;

    uint64_t calls_ = 0;                            ///< how often a guest was entered
    inline static FloatControl host_control_ = {};  ///< of all threads that run guests
    /// Modes of guests that changed theirs, by their clocks.
    std::map<const volatile Cycles *, FloatControl> float_controls_;

    /// The call and the clock that the timer saw last, and how often since.
    struct Seen {
        uint64_t call;
        Cycles clock;
        uint32_t times;
        bool computes;  ///< since the timer of wall time last came
    } seen_ = {};
    LostMemory lost_memory_;
    uintptr_t signal_at_ = 0, signal_sp_ = 0;  ///< instruction and stack pointer at the last signal
    Fault fault_;

    friend struct StackEntry;
};

}  // namespace kilotwin

#endif
