// Calls of a module's program, beside those of all guests (robots/native/guest.cpp): its init,
// lights, cells and CAN frames.
#include <algorithm>
#include <cstddef>
#include <cstring>

#include "modules/module.h"
#include "modules/timing.h"
#include "runtime/core/eeprom_map.h"

namespace kilotwin {

// Interrupts are off while the lights show that they work.
void Module::init() {
    const auto &api = *table().module;
    *table().ticks = last_tick_ = 0;
    *api.x = eeprom(EEPROM_X);
    *api.y = eeprom(EEPROM_Y);
    *api.uid = static_cast<uint16_t>(*api.x | *api.y << 8);
    *api.configuration_size = 0;
    for (uint8_t i = 0; i < MODULE_CONFIGURATION_BUFFER_SIZE; i++) api.configuration[i] = 0;
    *api.records = {};
    turns_init(&turns_);
    state_since_ = time_.now;
    interrupts_off_ = true;
    wait_until(time_.now + INIT_CYCLES);
    interrupts_off_ = false;
    lights_ = {};
    time_.next_tick = time_.now + time_.tick_length;
    came_back();
}

uint64_t Module::random_bits() {
    return context_.chance.bits(index_, Purpose::MODULE_RAND_HARD, rand_hard_draws_++);
}

uint8_t Module::distance_mm(distance_measurement_t measured) const {
    if (context_.gains_are_mm)
        return static_cast<uint8_t>(std::clamp<int16_t>(measured.high_gain, 0, UINT8_MAX));
    return gains_.estimate_mm(measured);
}

// It takes no time.
void Module::print(const char *text, uint32_t bytes, uint8_t /*line*/) {
    report(EventKind::PRINT, {text, bytes});
}

/// The calls of kt_module_host_t; all act on the module that runs.
struct Module::ModuleCalls {
    static Module &running() { return static_cast<Module &>(NativeGuest::running()); }

    static void autostart() { running().orders_.autostart = true; }

    static void light(uint8_t cell, uint8_t red, uint8_t green, uint8_t blue) {
        if (cell < CELLS_PER_MODULE) running().lights_[cell] = {{red, green, blue}};
    }

    static void cell_message(uint8_t cell, const message_t *message,
                             uint16_t (*checksum)(const message_t *)) {
        if (cell >= CELLS_PER_MODULE) return;
        const auto bit = static_cast<uint8_t>(1 << cell);
        auto &sending = running().sending_cells_;
        sending = static_cast<uint8_t>(message != nullptr ? sending | bit : sending & ~bit);
        if (message == nullptr) return;
        auto &kept = running().cell_messages_[cell];
        // Most programs repeat the same message; a checksum of 0 may stand for none yet.
        const bool same = std::memcmp(message, &kept, offsetof(message_t, crc)) == 0;
        if (same && kept.crc != 0) return;
        kept = *message;
        kept.crc = checksum(&kept);
    }

    static void send_at_once(uint8_t cell, const message_t *message) {
        running().ask(Asking::AT_ONCE, cell % CELLS_PER_MODULE, *message);
        running().came_back();
    }

    // Answers that are due go out before it.
    static void send_can(const kt_can_message_t *message, uint8_t x, uint8_t y, uint8_t type) {
        auto &module = running();
        const uint16_t id = kilogrid_id({x, y, type});
        if (id == KILOGRID_NO_ID) return;
        module.emit_answers(module.time_.now);
        module.can_frames.push_back({module.time_.now, frame_of(*message, id)});
    }

    static void broadcast_can(const kt_can_message_t *message) {
        running().broadcast_ = frame_of(*message, kilogrid_id({0, 0, ADDR_BROADCAST}));
        running().broadcast_pending_ = true;
    }

    static void can_address(uint16_t id, uint8_t address[3]) {
        kilogrid_address_t found = {0, 0, ADDR_BROADCAST};
        kilogrid_address(id, &found);
        address[0] = found.x;
        address[1] = found.y;
        address[2] = found.type;
    }
};

const kt_module_host_t Module::MODULE_CALLS = {
    ModuleCalls::autostart,    ModuleCalls::light,    ModuleCalls::cell_message,
    ModuleCalls::send_at_once, ModuleCalls::send_can, ModuleCalls::broadcast_can,
    ModuleCalls::can_address,
};

const kt_host_t &Module::calls() {
    static const kt_host_t CALLS = calls_with(MODULE_CALLS);
    return CALLS;
}

// Lets time pass up to `wake`; interrupts at that moment come before the program goes on. Where
// run() ends before, the program is suspended.
void Module::wait_until(Cycles wake) {
    if (table().settle != nullptr) table().settle();
    for (;;) {
        while (!in_interrupt_) {
            const Cycles at = next_interrupt();
            if (at > wake || at >= time_.until) break;
            serve_interrupt(at);
        }
        if (wake < time_.until) break;
        wake_ = wake;
        stack().suspend();
    }
    wake_ = NEVER;
    time_.now = std::max(time_.now, wake);
}

}  // namespace kilotwin
