#include "robots/native/stack.h"

#include <signal.h>
#include <sys/mman.h>
#include <time.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <new>
#include <utility>

#include "base/confinement.h"
#include "robots/native/abi.h"

namespace kilotwin {

// A stack that is left has, at its stack pointer, the callee-saved registers and the return
// address.
extern "C" {
/// Calls body(argument) on the stack that ends at `top`. Stores the caller's stack pointer in
/// `host`, and reloads it from there: body() may return to another caller than it had.
GuestStack::Outcome kt_call_on(uint8_t *top, void **host, void (*body)(void *), void *argument);
/// Leaves the present stack, stores its pointer in `from`, and continues on the stack left at `to`,
/// where the call returns `outcome`.
GuestStack::Outcome kt_switch_stack(void **from, void *to, GuestStack::Outcome outcome);
/// In place of an address that a call of the guest returns to: GuestStack::leave_after_fault().
void kt_leave_after_fault();
}

// kt_call_on() uses a call and a return, not jumps, so that the processor predicts returns.
#define KT_KEEP "push %rbp; push %rbx; push %r12; push %r13; push %r14; push %r15\n"
#define KT_BACK "pop %r15; pop %r14; pop %r13; pop %r12; pop %rbx; pop %rbp; ret\n"
#define KT_FUNCTION(name) \
    ".globl " name "\n.hidden " name "\n.type " name ", @function\n" name ":\n"
__asm__(".pushsection .text\n"  //
        KT_FUNCTION("kt_call_on") KT_KEEP
        "mov %rsp, (%rsi); mov %rdi, %rsp; push %rsi; push %rsi\n"
        "mov %rcx, %rdi; call *%rdx\n"
        "cld; pop %rsi; mov (%rsi), %rsp; xor %eax, %eax\n"  // Outcome::RETURNED
        KT_BACK                                              //
            KT_FUNCTION("kt_switch_stack") "cld\n" KT_KEEP
                                           "mov %rsp, (%rdi); mov %rsi, %rsp; mov %edx, %eax\n"  //
        KT_BACK                                                                                  //
            KT_FUNCTION("kt_leave_after_fault") "and $-16, %rsp; call kt_leave_now\n"
                                                ".popsection\n");

namespace {

constexpr size_t GUARD_BYTES = 16 * 4096;
constexpr int FAULT_SIGNALS[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP};
constexpr int TIMER_SIGNAL = SIGVTALRM;
constexpr long TIMER_NS = 5'000'000;  // of CPU time
constexpr uint32_t STUCK_TIMES = GuestStack::STUCK_CPU_S * (1'000'000'000 / TIMER_NS);
constexpr long WALL_TIMER_S = 1;
// A guest that sleeps is in libc, so that it takes two times STUCK_TIMES.
constexpr uint32_t WALL_WEIGHT = 2 * STUCK_TIMES * WALL_TIMER_S / GuestStack::STUCK_WALL_S;
// Flags of the processor: it traps behind each instruction; it checks alignment.
constexpr greg_t ALIGNMENT_FLAG = 1 << 18;
// Segments of 64-bit code and of its stack, in REG_CSGSFS.
constexpr greg_t SEGMENTS = 0x002b'0000'0000'0033, THEIR_BITS = ~0x0000'ffff'ffff'0000;
constexpr size_t SIGNAL_STACK_BYTES = 64 * 1024;
constexpr size_t RED_ZONE_BYTES = 128;

/// A thread's signal stack and its timer of CPU time.
class ThreadSignals {
  public:
    ThreadSignals() : memory_(SIGNAL_STACK_BYTES) {
        stack_t alternative = {};
        alternative.ss_sp = memory_.data();
        alternative.ss_size = memory_.size();
        sigaltstack(&alternative, nullptr);
        start(cpu_timer_, CLOCK_THREAD_CPUTIME_ID, 1, {0, TIMER_NS});
    }
    ~ThreadSignals() {
        timer_delete(cpu_timer_);
        if (wall_timer_ != nullptr) timer_delete(wall_timer_);
        stack_t none = {};
        none.ss_flags = SS_DISABLE;
        sigaltstack(&none, nullptr);
    }

    void watch_sleep() { start(wall_timer_, CLOCK_MONOTONIC, WALL_WEIGHT, {WALL_TIMER_S, 0}); }

  private:
    static void start(timer_t &timer, clockid_t clock, uint32_t weight, timespec each) {
        sigevent event = {};
        event.sigev_notify = SIGEV_THREAD_ID;
        event.sigev_signo = TIMER_SIGNAL;
        event.sigev_value.sival_int = static_cast<int>(weight);
        event._sigev_un._tid = gettid();
        timer_create(clock, &event, &timer);
        const itimerspec period = {each, each};
        timer_settime(timer, 0, &period, nullptr);
    }

    std::vector<uint8_t> memory_;
    timer_t cpu_timer_ = nullptr, wall_timer_ = nullptr;
};

ThreadSignals &signals_of_this_thread() {
    thread_local ThreadSignals signals;
    return signals;
}

// Without the flags of what has happened, which every computation sets.
constexpr uint32_t SSE_CONTROL = 0xFFC0;

GuestStack::FloatControl float_control() {
    GuestStack::FloatControl control = {};
    __asm__ volatile("stmxcsr %0; fnstcw %1" : "=m"(control.sse), "=m"(control.x87));
    control.sse &= SSE_CONTROL;
    return control;
}

void set_float_control(const GuestStack::FloatControl &control) {
    __asm__ volatile("ldmxcsr %0; fldcw %1" : : "m"(control.sse), "m"(control.x87));
}

/// Frees all registers of the x87 unit, those of MMX. Returns whether all else is as fninit leaves
/// it: no register is on top, and no exception is noted, which would be raised in the next guest
/// that wants to be told. To look at a free register instead (fxam) takes some processors 900
/// cycles, a seventh of `walk`.
bool empty_x87() {
    constexpr uint16_t TOP = 7 << 11, EXCEPTIONS = 0x7F;
    uint16_t status = 0;
    __asm__ volatile("fnstsw %0; emms" : "=a"(status));
    return (status & (TOP | EXCEPTIONS)) == 0;
}

}  // namespace

struct StackEntry {
    static void handle_fault(int signal, siginfo_t *info, void *context) {
        GuestStack::on_fault(signal, info, context);
    }
    [[noreturn]] static void leave() { GuestStack::leave_after_fault(); }
    static void handle_timer(int, siginfo_t *info, void *context) {
        GuestStack::on_timer(info, context);
    }
};

/// Called by kt_leave_after_fault().
extern "C" __attribute__((visibility("hidden"), used)) void kt_leave_now() { StackEntry::leave(); }

GuestStack &GuestStack::of(uint32_t share) {
    static std::vector<std::unique_ptr<GuestStack>> stacks;
    if (stacks.empty()) handle_signals();
    while (stacks.size() <= share) stacks.emplace_back(new GuestStack());
    return *stacks[share];
}

GuestStack::GuestStack() {
    void *area =
        mmap(nullptr, BYTES + 2 * GUARD_BYTES, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (area == MAP_FAILED) throw std::bad_alloc();
    memory_ = static_cast<uint8_t *>(area) + GUARD_BYTES;
    if (mprotect(memory_, BYTES, PROT_READ | PROT_WRITE) != 0) throw std::bad_alloc();
}

void GuestStack::handle_signals() {
    struct sigaction action = {};
    action.sa_sigaction = StackEntry::handle_fault;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    for (int signal : FAULT_SIGNALS) sigaction(signal, &action, nullptr);
    action.sa_sigaction = StackEntry::handle_timer;
    action.sa_flags |= SA_RESTART;
    sigaction(TIMER_SIGNAL, &action, nullptr);
}

void GuestStack::attend_system_calls() {
    struct sigaction action = {};
    action.sa_sigaction = StackEntry::handle_fault;
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigaction(SIGSYS, &action, nullptr);
}

void GuestStack::prepare_this_thread() {
    signals_of_this_thread();
    __asm__ volatile("fnclex");  // the host's libraries may have left notes
}

void GuestStack::serve_this_thread() {
    of(0);
    prepare_this_thread();
    host_control_ = float_control();
    close_worker();
}

void GuestStack::watch_sleep() { signals_of_this_thread().watch_sleep(); }

GuestStack::Outcome GuestStack::call(void (*body)(void *), void *argument,
                                     SuspendedCall &suspended) {
    calls_++;
    current_ = this;
    give_float_control();
    return back(kt_call_on(memory_ + BYTES, &host_, body, argument), suspended);
}

// Few of a swarm are within a delay() at a time: memory goes from call to call. Kept by each guest
// it would be 0.4 KB a robot.
GuestStack::Outcome GuestStack::resume(SuspendedCall &suspended) {
    calls_++;
    current_ = this;
    uint8_t *bottom = memory_ + BYTES - suspended.size();
    std::memcpy(bottom, suspended.data(), suspended.size());
    spare_ = std::exchange(suspended, {});
    give_float_control();
    return back(kt_switch_stack(&host_, bottom, Outcome::RETURNED), suspended);
}

GuestStack::Outcome GuestStack::back(Outcome outcome, SuspendedCall &suspended) {
    host_ = nullptr;
    current_ = nullptr;
    take_float_control();
    if (outcome == Outcome::SUSPENDED) {
        if (suspended.capacity() == 0) suspended.swap(spare_);
        suspended.assign(static_cast<uint8_t *>(guest_), memory_ + BYTES);
    }
    return outcome;
}

inline void GuestStack::give_float_control() {
    if (float_controls_.empty()) [[likely]]
        return;
    if (auto own = float_controls_.find(clock_); own != float_controls_.end())
        set_float_control(own->second);
}

/// Registers of the x87 unit (those of MMX) that the guest left full are emptied.
inline void GuestStack::take_float_control() {
    const FloatControl left = float_control();
    if (left == host_control_ && empty_x87()) [[likely]]
        return;
    if (left == host_control_)
        float_controls_.erase(clock_);
    else
        float_controls_[clock_] = left;
    __asm__ volatile("fninit");
    set_float_control(host_control_);
}

void GuestStack::suspend() { kt_switch_stack(&guest_, host_, Outcome::SUSPENDED); }

void GuestStack::abandon() {
    kt_switch_stack(&guest_, host_, Outcome::ABANDONED);
    __builtin_unreachable();
}

void GuestStack::leave_after_fault() {
    kt_switch_stack(&current_->guest_, current_->host_, Outcome::FAULT);
    __builtin_unreachable();
}

/// Fixes up a fault that an AVR would not have had. Whether the program can go on.
bool GuestStack::survives(int signal, const void *address, greg_t *registers) {
    if (signal == SIGTRAP) return lost_memory_.settle(registers);
    lost_memory_.settle(registers);
    if (signal == SIGFPE && divide_as_avr(registers))
        return on_mistake_(Mistake::DIVISION_BY_ZERO, nullptr);
    if (signal != SIGSEGV || !lost_memory_.redirect(registers, address)) return false;
    if (on_mistake_(Mistake::LOST_ACCESS, address)) return true;
    lost_memory_.settle(registers);
    return false;
}

// The handler must not jump out itself. It changes the interrupted context to continue in
// leave_after_fault() at the top of the guest's stack, whose frames are not needed any more: on
// return the kernel restores the signal mask.
void GuestStack::on_fault(int signal, void *info, void *context) {
    GuestStack *const running =
        current_ != nullptr && current_->host_ != nullptr ? current_ : nullptr;
    auto *fault = static_cast<siginfo_t *>(info);
    auto &registers = static_cast<ucontext_t *>(context)->uc_mcontext.gregs;
    if (signal == SIGBUS && (registers[REG_EFL] & ALIGNMENT_FLAG) != 0) {
        // A guest has set it, which neither the engine nor libraries bear; a robot has none.
        registers[REG_EFL] &= ~ALIGNMENT_FLAG;
        return;
    }
    if (signal == SIGSYS && running == nullptr) {  // the engine's or Python's own
        registers[REG_RAX] = -EPERM;
        return;
    }
    if (running == nullptr) {  // not in a guest: let the default action kill the process
        if (::signal(signal, SIG_DFL) != SIG_ERR)
            raise(signal);
        else  // confined; the kernel kills a process that faults where the signal is blocked
            sigaddset(&static_cast<ucontext_t *>(context)->uc_sigmask, signal);
        return;
    }
    GuestStack &stack = *running;
    stack.note_signal(registers);
    // These two come with the address behind their instruction.
    if (signal == SIGSYS || signal == SIGTRAP) stack.signal_at_--;
    if (signal == SIGSYS) return stack.refuse_system_call(registers, info);
    auto address = static_cast<const uint8_t *>(fault->si_addr);
    if (stack.survives(signal, address, registers)) return;
    bool memory_fault = signal == SIGSEGV || signal == SIGBUS;
    stack.fault_ = {signal,
                    address,
                    memory_fault && address >= stack.memory_ - GUARD_BYTES &&
                        address < stack.memory_,
                    registers[REG_RIP] == 0,
                    false,
                    -1,
                    stack.place(stack.signal_at_, stack.signal_sp_)};
    stack.end_call(registers);
}

/// Lets the interrupted thread go on in leave_after_fault().
void GuestStack::end_call(greg_t *registers) {
    registers[REG_EFL] &= ~TRAP_FLAG;
    registers[REG_CSGSFS] = (registers[REG_CSGSFS] & ~THEIR_BITS) | SEGMENTS;
    registers[REG_RIP] = reinterpret_cast<greg_t>(&GuestStack::leave_after_fault);
    registers[REG_RSP] = reinterpret_cast<greg_t>(memory_ + BYTES - 64 - sizeof(void *));
}

/// Whether the guest, found at the instruction `at`, is to be ended: its call and its clock have
/// been the same for too long. In its own code it holds nothing of the engine or of libc; one that
/// in twice the time was never found there has left it for good.
bool GuestStack::is_stuck(uintptr_t at, uint32_t weight) {
    if (seen_.call != calls_ || seen_.clock != *clock_) seen_ = {calls_, *clock_, 0, false};
    const bool of_wall_time = weight > 1;
    // One that has computed since does not sleep, however little CPU time it gets.
    if (!of_wall_time || !seen_.computes) seen_.times += weight;
    seen_.computes = !of_wall_time;
    if (seen_.times < STUCK_TIMES) return false;
    if (seen_.times >= 2 * STUCK_TIMES) return true;
    return is_guests_code(at);
}

const GuestStack::Code *GuestStack::guests_code(uintptr_t at) {
    for (const auto &code : code_)
        if (at >= code.begin && at < code.end) return &code;
    return nullptr;
}

void GuestStack::note_signal(const greg_t *registers) {
    signal_at_ = static_cast<uintptr_t>(registers[REG_RIP]);
    signal_sp_ = static_cast<uintptr_t>(registers[REG_RSP]);
}

/// Whether a word on the stack is an address that a guest's call returns to: behind a call.
bool GuestStack::returns_there(uintptr_t word) {
    constexpr uint8_t CALL = 0xE8, INDIRECT = 0xFF, INDIRECT_CALL = 2;
    constexpr size_t LONGEST = 7;
    const Code *code = guests_code(word);
    if (code == nullptr || word - code->begin < LONGEST) return false;
    const auto *behind = reinterpret_cast<const uint8_t *>(word);
    if (behind[-5] == CALL) return true;
    for (const int bytes : {2, 3, 4, 6, 7})
        if (behind[-bytes] == INDIRECT && (behind[1 - bytes] >> 3 & 7) == INDIRECT_CALL)
            return true;
    return false;
}

/// At an instruction, with the stack from `sp` on, wherever either of them points to.
GuestStack::Place GuestStack::place(uintptr_t at, uintptr_t sp) const {
    Place place;
    const Code *code = guests_code(at);
    place.code[place.count++] = code != nullptr ? static_cast<uint32_t>(at - code->zero) : 0;
    const auto bottom = reinterpret_cast<uintptr_t>(memory_), top = bottom + BYTES;
    if (sp < bottom - GUARD_BYTES || sp >= top) return place;
    for (uintptr_t word = (std::max(sp, bottom) + 7) / 8 * 8;
         word < top && place.count < Place::MOST; word += 8) {
        const uintptr_t back = *reinterpret_cast<const uintptr_t *>(word);
        if (returns_there(back))
            place.code[place.count++] = static_cast<uint32_t>(back - 1 - guests_code(back)->zero);
    }
    return place;
}

CodePath GuestStack::place_of_call(const void *frame) const {
    // The frame pointer, and the address that the function returns to.
    const auto *words = static_cast<const uintptr_t *>(frame);
    return place(words[1] - 1, reinterpret_cast<uintptr_t>(words + 2)).path();
}

/// By gcc's instructions, the loop's begin: count_loops.h has the count of its jump back elsewhere,
/// where no line of the source belongs to it.
CodePath GuestStack::place_of_loop(const uint8_t *frame) const {
    constexpr uint8_t JUMP = 0xEB, FAR_JUMP = 0xE9, FLAGS_BACK[] = {0x04, 0x7F, 0x9E, 0x58};
    const uint8_t *const spent = frame + KT_SPENT_REGISTER_BYTES;
    uintptr_t at;
    std::memcpy(&at, spent, sizeof at);
    const auto sp = reinterpret_cast<uintptr_t>(spent + sizeof at);
    if (!is_guests_code(at)) return place(0, sp).path();
    const auto *code = reinterpret_cast<const uint8_t *>(at);
    if (code[0] != JUMP) return place(at - 1, sp).path();
    code += 2 + static_cast<int8_t>(code[1]);
    if (std::memcmp(code, FLAGS_BACK, sizeof FLAGS_BACK) != 0) return place(at - 1, sp).path();
    code += sizeof FLAGS_BACK;
    if (code[0] == JUMP) {
        code += 2 + static_cast<int8_t>(code[1]);
    } else if (code[0] == FAR_JUMP) {
        int32_t way;
        std::memcpy(&way, code + 1, sizeof way);
        code += 1 + sizeof way + way;
    }
    return place(reinterpret_cast<uintptr_t>(code), sp).path();
}

/// Ends the call for a system call that was refused. One that libc made fails first, since libc may
/// hold locks: whatever it returns to in the guest's code, the call ends there.
void GuestStack::refuse_system_call(greg_t *registers, const void *info) {
    fault_ = {};
    fault_.signal = SIGSYS;
    fault_.system_call = static_cast<const siginfo_t *>(info)->si_syscall;
    fault_.place = place(signal_at_, signal_sp_);
    const auto sp = static_cast<uintptr_t>(registers[REG_RSP]);
    const auto bottom = reinterpret_cast<uintptr_t>(memory_);
    bool returns = false;
    if (!is_guests_code(static_cast<uintptr_t>(registers[REG_RIP])) && sp >= bottom &&
        sp < bottom + BYTES)
        for (uintptr_t at = sp / 8 * 8; at < bottom + BYTES; at += 8)
            if (auto &word = *reinterpret_cast<uintptr_t *>(at); is_guests_code(word)) {
                word = reinterpret_cast<uintptr_t>(&kt_leave_after_fault);
                returns = true;
            }
    if (returns)
        registers[REG_RAX] = -EPERM;
    else
        end_call(registers);
}

// A jump to itself never ends and changes nothing, so it does not matter when the timer finds it:
// the result stays deterministic.
void GuestStack::on_timer(void *info, void *context) {
    if (current_ == nullptr || current_->host_ == nullptr) return;
    GuestStack &stack = *current_;
    auto &registers = static_cast<ucontext_t *>(context)->uc_mcontext.gregs;
    stack.note_signal(registers);
    const auto weight = static_cast<uint32_t>(static_cast<siginfo_t *>(info)->si_value.sival_int);
    if (stack.is_stuck(static_cast<uintptr_t>(registers[REG_RIP]), weight)) {
        stack.lost_memory_.settle(registers);
        stack.fault_ = {};
        stack.fault_.stuck = true;
        stack.fault_.place = stack.place(stack.signal_at_, stack.signal_sp_);
        stack.end_call(registers);
        return;
    }
    auto sp = static_cast<uintptr_t>(registers[REG_RSP]);
    auto bottom = reinterpret_cast<uintptr_t>(stack.memory_);
    if (sp < bottom || sp >= bottom + BYTES) return;
    constexpr uint8_t JUMP_TO_SELF[] = {0xEB, 0xFE};
    if (std::memcmp(reinterpret_cast<const void *>(registers[REG_RIP]), JUMP_TO_SELF,
                    sizeof JUMP_TO_SELF) != 0)
        return;
    registers[REG_RIP] = reinterpret_cast<greg_t>(stack.empty_loop_);
    registers[REG_RSP] = static_cast<greg_t>((sp - RED_ZONE_BYTES) / 16 * 16 - sizeof(void *));
}

}  // namespace kilotwin
