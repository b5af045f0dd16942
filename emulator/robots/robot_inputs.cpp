// Inputs of a robot: messages, light on its receiver, commands and the states that they lead to.
#include <algorithm>
#include <cstring>

#include "base/board_clock.h"
#include "kilolib/core/calibration.h"
#include "kilolib/core/sleep_rhythm.h"
#include "kilolib/core/traits.h"
#include "robots/native/fault.h"
#include "robots/robot.h"

namespace kilotwin {

namespace {

// About what an AVR takes from address 0 to main(); it keeps a main() that jumps there from
// standing still in time.
constexpr uint32_t RESTART_CYCLES = CYCLES_PER_SECOND / 1000;

// Room for so many frames at once: a swarm has many robots that are shone on by few.
constexpr size_t MORE_LIGHTS = 3;

}  // namespace

void Robot::receive(Cycles at, const message_t &message, distance_measurement_t distance) {
    // Most come in order, and after the first one nothing else of the robot has to be looked at.
    if (inbox_.empty()) {
        if (life_ == Life::STOPPED) return;
        next_message_ = at;
    } else if (at < inbox_.back().at) {
        return receive_before_others(at, message, distance);
    }
    Reception &last = inbox_.emplace_back();  // filled where it stands, as frames are
    last.at = at;
    last.message = message;
    last.distance = distance;
}

void Robot::receive_before_others(Cycles at, const message_t &message,
                                  distance_measurement_t distance) {
    next_message_ = std::min(next_message_, at);
    auto later = [](Cycles time, const Reception &other) { return time < other.at; };
    const auto place = std::upper_bound(inbox_.begin(), inbox_.end(), at, later);
    inbox_.insert(place, {at, message, distance});
}

void Robot::tell(Cycles at, const message_t &message) {
    receive(at, message, {});
    const bool misses = !on_board() && program_->translation() != nullptr && context_->frame > 0;
    if (misses) written().told.push_back(at);
}

void Robot::disturb(Cycles begin, Cycles end, const message_t &message) {
    if (program_->translation() != nullptr) {
        auto &lights = written().lights;
        if (lights.size() == lights.capacity()) lights.reserve(lights.size() + MORE_LIGHTS);
        lights.push_back({BoardClock{power_up_, tick_length_}.own_cycle(begin), message, 0});
    }
    if (frames_seen_.size() == frames_seen_.capacity()) {
        auto over = [this](const auto &frame) { return frame.second <= now_; };
        frames_seen_.erase(std::remove_if(frames_seen_.begin(), frames_seen_.end(), over),
                           frames_seen_.end());
    }
    frames_seen_.emplace_back(begin, end);
}

bool Robot::disturbed() const {
    return std::any_of(frames_seen_.begin(), frames_seen_.end(),
                       [this](auto &frame) { return frame.first <= now_ && now_ < frame.second; });
}

// Before kilo_init() the receiver is off.
bool Robot::receives(const Reception &reception) {
    if (interrupts_off_) return false;
    if (core_.state == ROBOT_SLEEPING)
        return sleep_rhythm_receives(state_since_, &acts_at_, reception.at - FRAME_CYCLES);
    return next_tick_ != NEVER;
}

// There is no boot loader: BOOT leaves the robot in IDLE.
void Robot::obey(const message_t &message) {
    const auto before = static_cast<robot_state_t>(core_.state);
    const auto &table = program_->table();
    const auto action = robot_obey(&core_, &message, *table.uid, *table.turn_left);
    if (action == ACTION_NONE) return;
    switch_motors(action == ACTION_START_MOTORS);
    switch (action) {
    case ACTION_SAVE: save_calibration(message); break;
    case ACTION_BOOT:
        core_.state = ROBOT_IDLE;
        note(HAS_NO_LOADER, "it runs natively and has no boot loader, so that BOOT leaves it idle; "
                            "robots with cpu = \"avr\" can be flashed");
        break;
    case ACTION_RESTART: start_again(); GuestStack::instance().abandon();
    default: break;
    }
    if (core_.state != before) enter_state(before);
}

// The original blinks to the end first, also if other commands come meanwhile.
Cycles Robot::main_loop_sees(robot_state_t before) const {
    if (core_.state == ROBOT_SLEEPING) return now_;
    if (acts_at_ > now_ && before != ROBOT_SLEEPING) return acts_at_;
    const bool blinks = before == ROBOT_IDLE || before == ROBOT_CHARGING;
    if (program_->table().original == 0 || !blinks) return now_;
    return state_since_ + original_looks_after(now_ - state_since_);
}

// While a robot sleeps its timer stands still. All states but SETUP use the LED for themselves.
void Robot::enter_state(robot_state_t before) {
    acts_at_ = main_loop_sees(before);
    state_since_ = now_;
    loop_due_ = core_.state == ROBOT_SETUP || core_.state == ROBOT_MOVING;
    if (before == ROBOT_SLEEPING) next_tick_ = now_ + tick_length_;
    if (core_.state == ROBOT_SLEEPING) next_tick_ = NEVER;
    if (core_.state != ROBOT_SETUP) switch_led_off();
}

// MOVING: the motors concerned are kicked, then turn as ordered until the next command.
void Robot::start_motion() {
    robot_takes_motion(&core_);
    const motion_t motion = core_.motion;
    set_duties(robot_kick(motion));
    wait_until(now_ + KICK_MS * CYCLES_PER_MS);
    if (robot_keeps_motion(&core_)) set_duties(motion);
}

void Robot::save_calibration(const message_t &message) {
    program_->table().save_calibration(message.data);
    calibration_.uid = *program_->table().uid;
}

// kilolib_calibration_gains() of what the EEPROM holds, which is the engine's here.
void Robot::gains_saved(uint8_t which, uint8_t *content) const {
    for (uint8_t byte = 0; byte < REPORT_CONTENT; byte++)
        content[byte] =
            eeprom(eeprom_gain_place(static_cast<uint8_t>(which - CALIBRATION_GAINS), byte));
}

// As firmware/kilolib/avr/gains_read.c. What was saved since does not change a running program.
void Robot::read_gains() {
    if (!rare_ || !rare_->eeprom) return;
    rare_->gains = Own<gain_tables_t>::make();
    auto &tables = *rare_->gains;
    auto word = [this](uint8_t entry, uint8_t upper) {
        const int value = eeprom(eeprom_gain_place(entry, upper)) << 8 |
                          eeprom(eeprom_gain_place(entry, static_cast<uint8_t>(upper + 1)));
        return static_cast<uint16_t>(std::min(value, CONVERTER_MOST));
    };
    for (uint8_t entry = 0; entry < GAIN_ENTRIES; entry++) {
        tables.low[entry] = word(entry, 0);
        tables.high[entry] = word(entry, 2);
    }
}

// A jump to address 0: memory as after power-up, main() again, the stack forgotten.
void Robot::start_again() {
    std::memcpy(program_->table().state_begin, program_->initial_state(), program_->state_bytes());
    life_ = Life::OFF;
    core_ = {};
    acts_at_ = 0;
    state_since_ = now_;
    switch_led_off();
    next_tick_ = NEVER;
    in_interrupt_ = interrupts_off_ = tick_pending_ = loop_due_ = false;
    came_back();
}

void Robot::restart_from_zero(CodePath code) {
    note(JUMPS_TO_ZERO,
         "it jumped to address 0, as by a call through a NULL pointer; as on the robot, it starts "
         "again with main() and waits for RUN",
         std::move(code));
    start_again();
    now_ += RESTART_CYCLES;
}

}  // namespace kilotwin
