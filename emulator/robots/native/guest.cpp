#include "robots/native/guest.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "robots/native/fault.h"
#include "robots/native/undefined.h"

namespace kilotwin {

/// Calls of the program, through kt_host_t; all act on the guest that runs.
struct NativeGuest::Calls {
    static void init() { running_->init(); }

    // main()'s frames are not needed any more.
    static void start(void (*setup)(void), void (*loop)(void)) {
        running_->setup_ = setup;
        running_->loop_ = loop;
        running_->start();
        running_->stack().abandon();
    }

    static void wait(uint32_t cycles) {
        if (cycles == 0) return;  // no time passes: delay(0) in a loop is a loop that computes
        auto &guest = *running_;
        guest.wait_until(guest.time_.now + cycles);
        guest.came_back();
    }

    static void outputs() { running_->outputs_changed(); }

    static uint8_t rand_hard() {
        const auto bits = static_cast<uint8_t>(running_->random_bits());
        wait(RAND_HARD_CYCLES);
        return bits;
    }

    static uint8_t distance_mm(int16_t low_gain, int16_t high_gain) {
        return running_->distance_mm({low_gain, high_gain});
    }

    static uint8_t eeprom_read(uint16_t address) { return running_->eeprom(address); }
    static void eeprom_write(uint16_t address, uint8_t value) {
        running_->set_eeprom(address, value);
    }

    // A tick that was due while interrupts were off comes at once.
    static void interrupts(uint8_t on) {
        auto &guest = *running_;
        guest.interrupts_off_ = !on;
        guest.interrupts_changed();
        if (!on || !guest.tick_pending_ || guest.in_interrupt_) return;
        guest.tick_pending_ = false;
        guest.tick();
    }

    // After a retry the next match may be nearer than a tick.
    static uint8_t timer0() {
        const GuestTime &time = running_->time_;
        const Cycles latest = time.now + time.tick_length;
        const Cycles since = latest - std::min(time.next_tick, latest);
        return static_cast<uint8_t>(std::min<Cycles>(since / COUNT_CYCLES, TICK_MATCH));
    }

    static int16_t sensor(uint8_t channel) {
        running_->busy_.called();
        return running_->sensor(channel);
    }

    static void print(const char *text, uint32_t bytes, uint8_t line) {
        running_->busy_.called();
        running_->busy_.acted();
        *running_->table().budget -= TURNS_PER_PRINT;
        if (bytes > 0) running_->print(text, bytes, line);
    }

    static void serial_written() {
        running_->busy_.acted();
        running_->serial_written();
    }
    static void serial_ready() { running_->serial_ready(); }

    static void spent(const uint8_t *frame) { running_->budget_spent(frame); }

    static void undefined(uint8_t what, const void *data, uint64_t first, uint64_t second) {
        running_->busy_.acted();
        running_->report(EventKind::UNDEFINED, undefined_text(what, data, first, second),
                         running_->stack().place_of_call(__builtin_frame_address(0)));
    }

    static void unusable(const char *what) {
        auto &stack = running_->stack();
        running_->stop(EventKind::CRASH, what, stack.place_of_call(__builtin_frame_address(0)));
        stack.abandon();
    }

    // Only interrupts go on: what `for (;;);` means.
    static void empty_loop() {
        auto &guest = *running_;
        CodePath code = guest.stack().place_of_signal();
        guest.wait_until(guest.time_.now + BusyWatch::WARN_AFTER);
        guest.report(EventKind::BUSY_WAIT, "it stays in an empty endless loop", std::move(code));
        for (;;) guest.wait_until(NEVER);
    }

    // The fault came from the program, or from libc on its behalf, so that the engine may work as
    // usual here.
    static bool mistake(GuestStack::Mistake mistake, const void *address) {
        running_->busy_.acted();
        auto [noted, text] = explain(mistake, address, *running_->program_);
        if (noted == 0) return false;
        if (!(running_->noted() & noted))
            running_->note(noted, std::move(text), running_->stack().place_of_signal());
        return true;
    }
};

const kt_host_t NativeGuest::CALLS = {
    Calls::init,           Calls::start,        Calls::wait,
    Calls::outputs,        Calls::rand_hard,    Calls::distance_mm,
    Calls::eeprom_read,    Calls::eeprom_write, Calls::interrupts,
    Calls::timer0,         Calls::sensor,       Calls::print,
    Calls::serial_written, Calls::serial_ready, Calls::spent,
    Calls::unusable,       Calls::undefined,    nullptr,
};

kt_host_t NativeGuest::calls_with(const kt_module_host_t &of_a_module) {
    kt_host_t calls = CALLS;
    calls.module = &of_a_module;
    return calls;
}

NativeGuest::NativeGuest(Program &program, GuestTime &time, uint8_t *image, const kt_host_t &calls)
    : program_(&program),
      time_(time),
      image_(image) {
    std::memcpy(image_, program.initial_state(), program.state_bytes());
    *table().host = &calls;
}

NativeGuest::~NativeGuest() {
    stack().forget(&time_.now);
    program_->evict(image_);
}

// An abandoned call, of main() or of a restart, is followed by the next one at once.
void NativeGuest::execute() {
    running_ = this;
    program_->make_resident(image_);
    auto &stack = this->stack();
    stack.set_guest(Calls::empty_loop, Calls::mistake, &time_.now);
    GuestStack::Outcome outcome;
    do {
        outcome = is_suspended_ ? stack.resume(suspended_) : stack.call(body, this, suspended_);
        is_suspended_ = outcome == GuestStack::Outcome::SUSPENDED;
        const bool at_zero = outcome == GuestStack::Outcome::FAULT && stack.fault().jump_to_zero;
        if (at_zero && restarts(stack.fault().place.path()))
            outcome = GuestStack::Outcome::ABANDONED;
        if (outcome == GuestStack::Outcome::ABANDONED) abandoned();
    } while (outcome == GuestStack::Outcome::ABANDONED && !is_stopped() && time_.now < time_.until);
    if (outcome == GuestStack::Outcome::FAULT) {
        auto [kind, text, code] = explain(stack.fault(), *program_);
        stop(kind, std::move(text), std::move(code));
    }
    running_ = nullptr;
}

void NativeGuest::suspend() {
    int32_t &left = *table().budget;
    const int32_t budget = left, held_back = program_->turns_held_back;
    stack().suspend();
    left = budget;
    program_->turns_held_back = held_back;
}

void NativeGuest::note(uint8_t mistake, std::string text, CodePath code) {
    if (noted() & mistake) return;
    noted() |= mistake;
    report(EventKind::NOTE, std::move(text), std::move(code));
}

// The program took more turns than fit into a tick without giving time back. Nothing happens around
// it while its memory is compared; then time passes up to the next interrupt.
void NativeGuest::budget_spent(const uint8_t *frame) {
    auto &stack = this->stack();
    const auto finding = busy_.look(*program_, frame, stack.top());
    if (finding == BusyWatch::Finding::LOOKING) return;
    const int32_t budget = *table().budget;
    switch (busy_.judge(finding, time_.now)) {
    case BusyWatch::Verdict::FINE: break;
    case BusyWatch::Verdict::WARN:
        report(EventKind::BUSY_WAIT, BusyWatch::WARNING, stack.place_of_loop(frame));
        break;
    case BusyWatch::Verdict::ENDLESS:
        stop(EventKind::ENDLESS, BusyWatch::ACCUSATION, stack.place_of_loop(frame));
        stack.abandon();
    }
    wait_until(in_interrupt_ ? time_.now + TICK_CYCLES : std::max(time_.next_tick, time_.now));
    *table().budget = budget;
}

}  // namespace kilotwin
