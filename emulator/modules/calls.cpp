#include <algorithm>
#include <cstring>

#include "modules/module.h"
#include "modules/timing.h"
#include "robots/native/fault.h"
#include "robots/native/undefined.h"
#include "runtime/core/eeprom_map.h"

namespace kilotwin {

/// Calls of the guest, through kt_host and its module part; all act on the module that runs.
struct Module::HostCalls {
    // Interrupts are off while the lights show that they work.
    static void init() {
        auto &module = *running_;
        const auto &table = module.program_->table();
        const auto &api = *table.module;
        *table.ticks = module.last_tick_ = 0;
        *api.x = module.eeprom(EEPROM_X);
        *api.y = module.eeprom(EEPROM_Y);
        *api.uid = static_cast<uint16_t>(*api.x | *api.y << 8);
        *api.configuration_size = 0;
        for (uint8_t i = 0; i < MODULE_CONFIGURATION_BUFFER_SIZE; i++) api.configuration[i] = 0;
        *api.records = {};
        turns_init(&module.turns_);
        module.state_since_ = module.now_;
        module.interrupts_off_ = true;
        module.wait_until(module.now_ + INIT_CYCLES);
        module.interrupts_off_ = false;
        module.lights_ = {};
        module.next_tick_ = module.now_ + module.tick_;
        module.came_back();
    }

    // main()'s frames are not needed any more.
    static void start(void (*setup)(void), void (*loop)(void)) {
        running_->setup_ = setup;
        running_->loop_ = loop;
        running_->life_ = Life::ALIVE;
        GuestStack::instance().abandon();
    }

    static void autostart() { running_->orders_.autostart = true; }

    static void wait(uint32_t cycles) {
        if (cycles == 0) return;  // delay(0) lets no time pass
        running_->wait_until(running_->now_ + cycles);
        running_->came_back();
    }

    static void outputs() {}  // a module's LEDs are not on its pins

    static uint8_t rand_hard() {
        auto &module = *running_;
        auto bits = module.context_.chance.bits(module.index_, Purpose::MODULE_RAND_HARD,
                                                module.rand_hard_draws_++);
        wait(RAND_HARD_CYCLES);
        return static_cast<uint8_t>(bits);
    }

    static int16_t sensor(uint8_t) { return 0; }

    static uint8_t distance_mm(int16_t low_gain, int16_t high_gain) {
        if (running_->context_.gains_are_mm)
            return static_cast<uint8_t>(std::clamp<int16_t>(high_gain, 0, UINT8_MAX));
        return running_->gains_.estimate_mm({low_gain, high_gain});
    }

    static uint8_t eeprom_read(uint16_t address) { return running_->eeprom(address); }
    static void eeprom_write(uint16_t address, uint8_t value) {
        running_->set_eeprom(address, value);
    }

    // A tick that was due while interrupts were off comes at once.
    static void interrupts(uint8_t on) {
        auto &module = *running_;
        module.interrupts_off_ = !on;
        if (on && module.tick_pending_ && !module.in_interrupt_) {
            module.tick_pending_ = false;
            module.tick();
        }
    }

    // After a retry the next match may be nearer than a tick.
    static uint8_t timer0() {
        const auto &module = *running_;
        const Cycles next = std::min(module.next_tick_, module.now_ + module.tick_);
        return static_cast<uint8_t>(
            std::min<Cycles>((module.now_ + module.tick_ - next) / COUNT_CYCLES, TICK_MATCH));
    }

    static void print(const char *text, uint32_t bytes, uint8_t) {
        *running_->program_->table().budget -= TURNS_PER_PRINT;
        running_->report(EventKind::PRINT, {text, bytes});
    }

    // Prints of modules take no time.
    static void serial_written() {}
    static void serial_ready() {}

    static void spent(const uint8_t *frame) { running_->budget_spent(frame); }

    static void undefined(uint8_t what, const void *data, uint64_t first, uint64_t second) {
        running_->report(EventKind::UNDEFINED, undefined_text(what, data, first, second),
                         GuestStack::instance().place_of_call(__builtin_frame_address(0)));
    }

    static void unusable(const char *what) {
        auto &stack = GuestStack::instance();
        running_->stop(EventKind::CRASH, what, stack.place_of_call(__builtin_frame_address(0)));
        stack.abandon();
    }

    // Only interrupts go on: what `for (;;);` means.
    static void empty_loop() {
        running_->report(EventKind::BUSY_WAIT, "it stays in an empty endless loop",
                         GuestStack::instance().place_of_signal());
        for (;;) running_->wait_until(NEVER);
    }

    static bool mistake(GuestStack::Mistake what, const void *address) {
        auto [noted, text] = explain(what, address, *running_->program_);
        if (noted == 0) return false;
        if (!(running_->noted_ & noted))
            running_->report(EventKind::NOTE, std::move(text),
                             GuestStack::instance().place_of_signal());
        running_->noted_ |= noted;
        return true;
    }

    static void light(uint8_t cell, uint8_t red, uint8_t green, uint8_t blue) {
        if (cell < CELLS_PER_MODULE) running_->lights_[cell] = {{red, green, blue}};
    }

    static void cell_message(uint8_t cell, const message_t *message,
                             uint16_t (*checksum)(const message_t *)) {
        if (cell >= CELLS_PER_MODULE) return;
        const auto bit = static_cast<uint8_t>(1 << cell);
        auto &sending = running_->sending_cells_;
        sending = static_cast<uint8_t>(message != nullptr ? sending | bit : sending & ~bit);
        if (message == nullptr) return;
        auto &kept = running_->cell_messages_[cell];
        // Most programs repeat the same message; a checksum of 0 may stand for none yet.
        const bool same = std::memcmp(message, &kept, offsetof(message_t, crc)) == 0;
        if (same && kept.crc != 0) return;
        kept = *message;
        kept.crc = checksum(&kept);
    }

    static void send_at_once(uint8_t cell, const message_t *message) {
        running_->ask(Asking::AT_ONCE, cell % CELLS_PER_MODULE, *message);
        running_->came_back();
    }

    // Answers that are due go out before it.
    static void send_can(const kt_can_message_t *message, uint8_t x, uint8_t y, uint8_t type) {
        auto &module = *running_;
        const uint16_t id = kilogrid_id({x, y, type});
        if (id == KILOGRID_NO_ID) return;
        module.emit_answers(module.now_);
        module.can_frames.push_back({module.now_, frame_of(*message, id)});
    }

    static void broadcast_can(const kt_can_message_t *message) {
        running_->broadcast_ = frame_of(*message, kilogrid_id({0, 0, ADDR_BROADCAST}));
        running_->broadcast_pending_ = true;
    }

    static void can_address(uint16_t id, uint8_t address[3]) {
        kilogrid_address_t found = {0, 0, ADDR_BROADCAST};
        kilogrid_address(id, &found);
        address[0] = found.x;
        address[1] = found.y;
        address[2] = found.type;
    }
};

const kt_module_host_t Module::MODULE_HOST = {
    HostCalls::autostart,    HostCalls::light,    HostCalls::cell_message,
    HostCalls::send_at_once, HostCalls::send_can, HostCalls::broadcast_can,
    HostCalls::can_address,
};

const kt_host_t Module::HOST = {
    HostCalls::init,           HostCalls::start,        HostCalls::wait,
    HostCalls::outputs,        HostCalls::rand_hard,    HostCalls::distance_mm,
    HostCalls::eeprom_read,    HostCalls::eeprom_write, HostCalls::interrupts,
    HostCalls::timer0,         HostCalls::sensor,       HostCalls::print,
    HostCalls::serial_written, HostCalls::serial_ready, HostCalls::spent,
    HostCalls::unusable,       HostCalls::undefined,    &Module::MODULE_HOST,
};

/// Empty loops and mistakes of the guest that runs next are the module's.
void Module::attend_stack() {
    GuestStack::instance().set_guest(HostCalls::empty_loop, HostCalls::mistake, &now_);
}

// Lets time pass up to `wake`; interrupts at that moment come before the program goes on. Where
// run() ends before, the program is suspended.
void Module::wait_until(Cycles wake) {
    const auto &table = program_->table();
    if (table.settle != nullptr) table.settle();
    for (;;) {
        while (!in_interrupt_) {
            const Cycles at = next_interrupt();
            if (at > wake || at >= until_) break;
            serve_interrupt(at);
        }
        if (wake < until_) break;
        wake_ = wake;
        GuestStack::instance().suspend();
    }
    wake_ = NEVER;
    now_ = std::max(now_, wake);
}

// A program that waits for an interrupt in a loop goes on at the next one.
void Module::budget_spent(const uint8_t *frame) {
    auto &stack = GuestStack::instance();
    const auto finding = busy_.look(*program_, frame, stack.top(), false);
    if (finding == BusyWatch::Finding::LOOKING) return;
    const int32_t budget = *program_->table().budget;
    switch (busy_.judge(finding, now_)) {
    case BusyWatch::Verdict::FINE: break;
    case BusyWatch::Verdict::WARN:
        report(EventKind::BUSY_WAIT, BusyWatch::WARNING, stack.place_of_loop(frame));
        break;
    case BusyWatch::Verdict::ENDLESS:
        stop(EventKind::ENDLESS, BusyWatch::ACCUSATION, stack.place_of_loop(frame));
        stack.abandon();
    }
    wait_until(in_interrupt_ ? now_ + TICK_CYCLES : std::max(next_tick_, now_));
    *program_->table().budget = budget;
}

}  // namespace kilotwin
