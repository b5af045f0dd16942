// Calls of a robot's program: the engine's side of the Kilobot API (kt_host_t, abi.h). All of it
// acts on the robot that is running.
#include <algorithm>

#include "robots/native/fault.h"
#include "robots/native/undefined.h"
#include "robots/robot.h"

namespace kilotwin {

Robot *Robot::running = nullptr;

struct Robot::HostCalls {
    static void init() {
        auto &robot = *running;
        const auto &table = robot.program_->table();
        *table.ticks = robot.last_tick_ = 0;
        if (table.tx_period != nullptr) *table.tx_period = TX_PERIOD_DEFAULT;
        robot_core_init(&robot.core_);
        robot.read_gains();
        robot.next_tick_ = robot.now_ + robot.tick_length_;
        robot.interrupts_off_ = false;
        robot.only_ticks_until_ = 0;
    }

    static void start(void (*setup)(void), void (*loop)(void)) {
        running->setup_ = setup;
        running->loop_ = loop;
        running->life_ = Life::ALIVE;
        GuestStack::instance().abandon();
    }

    static void wait(uint32_t cycles) {
        if (cycles == 0) return;  // no time passes: delay(0) in a loop is a loop that computes
        running->wait_until(running->now_ + cycles);
        running->came_back();
    }

    static void outputs() {
        auto &robot = *running;
        robot.busy_.called();
        const uint64_t before = robot.outputs_seen_;
        robot.look_at_outputs();
        if (robot.outputs_seen_ != before) robot.busy_.acted();
    }

    static uint8_t rand_hard() {
        auto &robot = *running;
        auto bits =
            robot.context_->chance.bits(robot.index_, Purpose::RAND_HARD, robot.rand_hard_draws_++);
        wait(RAND_HARD_CYCLES);
        return static_cast<uint8_t>(bits);
    }

    static int16_t sensor(uint8_t which) {
        auto &robot = *running;
        robot.busy_.called();
        if (robot.disturbed()) return -1;
        robot.stale_conversion_ = -1;
        if (which == KT_SENSOR_LIGHT) return robot.light;
        if (which == KT_SENSOR_TEMPERATURE) return robot.context_->temperature;
        const int16_t reading = robot.voltage(robot.now_);
        if (robot.program_->table().original != 0) robot.stale_conversion_ = reading;
        return reading;
    }

    static uint8_t distance_mm(int16_t low_gain, int16_t high_gain) {
        if (running->context_->gains_are_mm)
            return static_cast<uint8_t>(std::clamp<int16_t>(high_gain, 0, UINT8_MAX));
        const distance_measurement_t measured = {low_gain, high_gain};
        const auto &rare = running->rare_;
        return rare && rare->gains ? kilolib_gains_distance(&*rare->gains, &measured)
                                   : running->calibration_.gains.estimate_mm(measured);
    }

    static uint8_t eeprom_read(uint16_t address) { return running->eeprom(address); }
    static void eeprom_write(uint16_t address, uint8_t value) {
        running->set_eeprom(address, value);
    }

    static void interrupts(uint8_t on) {
        auto &robot = *running;
        robot.interrupts_off_ = !on;
        robot.only_ticks_until_ = 0;
        if (on && robot.tick_pending_ && !robot.in_interrupt_) {
            robot.tick_pending_ = false;
            robot.tick();
        }
    }

    static uint8_t timer0() {
        Cycles since = running->now_ + running->tick_length_ -
                       std::min(running->next_tick_, running->now_ + running->tick_length_);
        return static_cast<uint8_t>(std::min<Cycles>(since / COUNT_CYCLES, TICK_MATCH));
    }

    // On the serial line it is reported when its last byte has been taken.
    static void print(const char *text, uint32_t bytes, uint8_t line) {
        auto &robot = *running;
        robot.busy_.called();
        robot.busy_.acted();
        *robot.program_->table().budget -= TURNS_PER_PRINT;
        if (bytes == 0) return;
        if (line == KT_LINE_WAITS) wait_for_line(robot.written().serial.write(robot.now_, bytes));
        if (line == KT_LINE_QUEUES) bytes = robot.written().serial.queue(robot.now_, bytes);
        if (bytes > 0) robot.report(EventKind::PRINT, {text, bytes});
    }

    static void serial_written() {
        running->busy_.acted();
        running->written().serial.write(running->now_, 1);
    }
    static void serial_ready() {
        if (running->rare_) wait_for_line(running->rare_->serial.ready(running->now_));
    }

    static void wait_for_line(Cycles until) {
        if (until <= running->now_) return;
        running->wait_until(until);
        running->came_back();
    }

    static void spent(const uint8_t *frame) { running->budget_spent(frame); }

    // Only interrupts go on: what `for (;;);` means.
    static void empty_loop() {
        auto &robot = *running;
        CodePath code = GuestStack::instance().place_of_signal();
        robot.wait_until(robot.now_ + BusyWatch::WARN_AFTER);
        robot.report(EventKind::BUSY_WAIT, "it stays in an empty endless loop", std::move(code));
        for (;;) robot.wait_until(NEVER);
    }

    // The fault came from the program, or from libc on its behalf, so that the engine may work as
    // usual here.
    static bool mistake(GuestStack::Mistake mistake, const void *address) {
        running->busy_.acted();
        auto [noted, text] = explain(mistake, address, *running->program_);
        if (noted == 0) return false;
        if (!(running->noted_ & noted))
            running->note(noted, std::move(text), GuestStack::instance().place_of_signal());
        return true;
    }

    static void undefined(uint8_t what, const void *data, uint64_t first, uint64_t second) {
        running->busy_.acted();
        running->report(EventKind::UNDEFINED, undefined_text(what, data, first, second),
                        GuestStack::instance().place_of_call(__builtin_frame_address(0)));
    }

    static void unusable(const char *what) {
        auto &stack = GuestStack::instance();
        running->stop(EventKind::CRASH, what, stack.place_of_call(__builtin_frame_address(0)));
        stack.abandon();
    }
};

const kt_host_t Robot::HOST = {
    HostCalls::init,           HostCalls::start,        HostCalls::wait,
    HostCalls::outputs,        HostCalls::rand_hard,    HostCalls::distance_mm,
    HostCalls::eeprom_read,    HostCalls::eeprom_write, HostCalls::interrupts,
    HostCalls::timer0,         HostCalls::sensor,       HostCalls::print,
    HostCalls::serial_written, HostCalls::serial_ready, HostCalls::spent,
    HostCalls::unusable,       HostCalls::undefined,    nullptr,
};

void Robot::attend_faults() {
    GuestStack::instance().set_guest(HostCalls::empty_loop, HostCalls::mistake, &now_);
}

// The program took more turns than fit into a tick without giving time back. Nothing happens around
// it while its memory is compared; then time passes.
void Robot::budget_spent(const uint8_t *frame) {
    auto &stack = GuestStack::instance();
    const auto finding = busy_.look(*program_, frame, stack.top(), true);
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

uint8_t Robot::eeprom(uint16_t address) const {
    address %= EEPROM_BYTES;
    const bool is_written = rare_ && rare_->eeprom;
    return is_written ? (*rare_->eeprom)[address] : calibrated_byte(calibration_, address);
}

void Robot::set_eeprom(uint16_t address, uint8_t value) {
    auto &image = written().eeprom;
    if (!image) image = Own<EepromImage>::make(eeprom_of(calibration_));
    (*image)[address % EEPROM_BYTES] = value;
}

Robot::Rare &Robot::written() {
    if (!rare_) rare_ = Own<Rare>::make();
    return *rare_;
}

}  // namespace kilotwin
