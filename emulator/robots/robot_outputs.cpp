// Outputs of a robot: motors, LED, the battery they drain, and events.
#include <algorithm>
#include <cstring>

#include "kilolib/core/lights.h"
#include "kilolib/core/pins.h"
#include "kilolib/core/sleep_rhythm.h"
#include "robots/battery.h"
#include "robots/robot.h"

namespace kilotwin {

// Motors and LED by the registers: hardware.md 1.8.
void Robot::take_outputs(uint64_t seen) {
    outputs_seen_ = seen;
    kt_outputs_t registers;
    std::memcpy(&registers, &seen, sizeof registers);
    color_ = led_color(static_cast<uint8_t>(registers.ddrc & ~registers.portc),
                       static_cast<uint8_t>(registers.ddrd & ~registers.portd));
    uint8_t left = registers.ddrb & LEFT_MOTOR_MASK ? registers.ocr2a : 0;
    uint8_t right = registers.ddrd & RIGHT_MOTOR_MASK ? registers.ocr2b : 0;
    drive({now_, left, right});
}

void Robot::drive(const MotorCommand &command) {
    if (command.left == left_ && command.right == right_) return;
    left_ = command.left;
    right_ = command.right;
    if (driving_since_ != NEVER) driven_ += command.at - driving_since_;
    driving_since_ = left_ != 0 || right_ != 0 ? command.at : NEVER;
    motor_commands.push_back(command);
}

void Robot::set_duties(motion_t duties) {
    auto &outputs = *program_->table().outputs;
    outputs.ocr2a = duties.left;
    outputs.ocr2b = duties.right;
    look_at_outputs();
}

void Robot::switch_motors(bool on) {
    auto &outputs = *program_->table().outputs;
    outputs.ddrb = on ? outputs.ddrb | LEFT_MOTOR_MASK : outputs.ddrb & ~LEFT_MOTOR_MASK;
    outputs.ddrd = on ? outputs.ddrd | RIGHT_MOTOR_MASK : outputs.ddrd & ~RIGHT_MOTOR_MASK;
    set_duties({0, 0});
}

void Robot::switch_led_off() {
    auto &outputs = *program_->table().outputs;
    outputs.ddrc = outputs.ddrc & ~LED_MASK_C;
    outputs.ddrd = outputs.ddrd & ~LED_MASK_D;
    look_at_outputs();
}

int16_t Robot::voltage(Cycles at) const {
    const Cycles driven = driven_ + (driving_since_ < at ? at - driving_since_ : 0);
    return battery_reading(driven, at > power_up_ ? at - power_up_ : 0, context_->battery);
}

// In SETUP, RUNNING and MOVING the LED is what the registers make of it. In CHARGING the charger is
// taken to be at work.
uint8_t Robot::color(Cycles at) const {
    // The LED is what the registers say: on a chip, before kilo_start() and after its end.
    if (life_ != Life::ALIVE || on_board() || program_->translation() != nullptr) return color_;
    const Cycles in_state = at > state_since_ ? at - state_since_ : 0;
    switch (core_.state) {
    case ROBOT_IDLE: return blink_is_on(in_state) ? IDLE_COLOR : 0;
    case ROBOT_CHARGING: return blink_is_on(in_state) ? CHARGING_COLOR : 0;
    case ROBOT_BATTERY: return battery_color(voltage(at));
    case ROBOT_SLEEPING: return sleep_rhythm_color(acts_at_, std::max(at, state_since_));
    default: return color_;
    }
}

void Robot::print(Cycles at, uint32_t tick, std::string text) {
    now_ = at;
    last_tick_ = tick;
    report(EventKind::PRINT, std::move(text));
}

void Robot::remark(Cycles at, uint32_t tick, std::string text) {
    now_ = at;
    last_tick_ = tick;
    report(EventKind::NOTE, std::move(text));
}

void Robot::crash(Cycles at, uint32_t tick, std::string text, CodePath code) {
    now_ = at;
    last_tick_ = tick;
    stop(EventKind::CRASH, std::move(text), std::move(code));
}

void Robot::stop(EventKind kind, std::string text, CodePath code) {
    report(kind, std::move(text), std::move(code));
    life_ = Life::STOPPED;
    if (left_ != 0 || right_ != 0) motor_commands.push_back({now_, 0, 0});
    left_ = right_ = 0;
    suspended_.clear();
    inbox_.clear();
    inbox_next_ = 0;
    inbox_changed();
}

void Robot::note(uint8_t mistake, std::string text, CodePath code) {
    if (noted_ & mistake) return;
    noted_ |= mistake;
    report(EventKind::NOTE, std::move(text), std::move(code));
}

void Robot::report(EventKind kind, std::string text, CodePath code) {
    context_->events.push_back(
        {now_, index_, last_tick_, *name_, kind, std::move(text), std::move(code)});
}

}  // namespace kilotwin
