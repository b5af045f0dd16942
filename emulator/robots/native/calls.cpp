// Calls of a native robot's program, beside those of all guests (guest.cpp): the Kilobot's init,
// sensors, serial line and outputs.
#include <algorithm>
#include <cstring>

#include "kilolib/core/lights.h"
#include "kilolib/core/pins.h"
#include "kilolib/core/sleep_rhythm.h"
#include "robots/native/outputs.h"
#include "robots/native/robot.h"

namespace kilotwin {

void NativeRobot::init() {
    *table().ticks = robot_.last_tick = 0;
    if (table().tx_period != nullptr) *table().tx_period = TX_PERIOD_DEFAULT;
    robot_core_init(&robot_.core);
    read_gains();
    robot_.next_tick = robot_.now + robot_.tick_length;
    interrupts_off_ = false;
    robot_.only_ticks_until = 0;
}

uint64_t NativeRobot::random_bits() {
    return robot_.context->chance.bits(robot_.index, Purpose::RAND_HARD, robot_.rand_hard_draws++);
}

// The original's get_voltage() leaves the converter there (core/traits.h).
int16_t NativeRobot::sensor(uint8_t channel) {
    if (robot_.disturbed()) return -1;
    const int16_t reading = reading_of(robot_, channel, robot_.now);
    const bool stays = channel == SENSOR_BATTERY && table().original != 0;
    stale_conversion_ = stays ? reading : int16_t{-1};
    return reading;
}

uint8_t NativeRobot::distance_mm(distance_measurement_t measured) const {
    if (robot_.context->gains_are_mm)
        return static_cast<uint8_t>(std::clamp<int16_t>(measured.high_gain, 0, UINT8_MAX));
    return rare_ && rare_->gains ? kilolib_gains_distance(&*rare_->gains, &measured)
                                 : robot_.calibration.gains.estimate_mm(measured);
}

// On the serial line it is reported when its last byte has been taken.
void NativeRobot::print(const char *text, uint32_t bytes, uint8_t line) {
    if (line == KT_LINE_WAITS) wait_for_line(written().serial.write(robot_.now, bytes));
    if (line == KT_LINE_QUEUES) bytes = written().serial.queue(robot_.now, bytes);
    if (bytes > 0) report(EventKind::PRINT, {text, bytes});
}

void NativeRobot::serial_written() { written().serial.write(robot_.now, 1); }

void NativeRobot::serial_ready() {
    if (rare_) wait_for_line(rare_->serial.ready(robot_.now));
}

void NativeRobot::wait_for_line(Cycles until) {
    if (until <= robot_.now) return;
    wait_until(until);
    came_back();
}

NativeRobot::Rare &NativeRobot::written() {
    if (!rare_) rare_ = Own<Rare>::make();
    return *rare_;
}

void NativeRobot::stop(EventKind kind, std::string text, CodePath code) {
    robot_.stop(kind, std::move(text), std::move(code));
    drop_call();
}

// Outputs

void NativeRobot::outputs_changed() {
    busy_.called();
    const uint64_t before = robot_.outputs_seen;
    look_at_outputs();
    if (robot_.outputs_seen != before) busy_.acted();
}

void NativeRobot::take_outputs(uint64_t seen) {
    robot_.outputs_seen = seen;
    kt_outputs_t registers;
    std::memcpy(&registers, &seen, sizeof registers);
    kilotwin::take_outputs(robot_, registers);
}

void NativeRobot::set_duties(motion_t duties) {
    auto &outputs = *table().outputs;
    outputs.ocr2a = duties.left;
    outputs.ocr2b = duties.right;
    look_at_outputs();
}

void NativeRobot::switch_motors(bool on) {
    auto &outputs = *table().outputs;
    outputs.ddrb = on ? outputs.ddrb | LEFT_MOTOR_MASK : outputs.ddrb & ~LEFT_MOTOR_MASK;
    outputs.ddrd = on ? outputs.ddrd | RIGHT_MOTOR_MASK : outputs.ddrd & ~RIGHT_MOTOR_MASK;
    set_duties({0, 0});
}

void NativeRobot::switch_led_off() {
    auto &outputs = *table().outputs;
    outputs.ddrc = outputs.ddrc & ~LED_MASK_C;
    outputs.ddrd = outputs.ddrd & ~LED_MASK_D;
    look_at_outputs();
}

// In SETUP, RUNNING and MOVING the LED is what the registers make of it, as before kilo_start() and
// after the program's end. In CHARGING the charger is taken to be at work.
uint8_t NativeRobot::color(Cycles at) const {
    if (robot_.life != RobotRecord::Life::ALIVE) return robot_.color;
    const Cycles in_state = at > state_since_ ? at - state_since_ : 0;
    switch (robot_.core.state) {
    case ROBOT_IDLE: return blink_is_on(in_state) ? IDLE_COLOR : 0;
    case ROBOT_CHARGING: return blink_is_on(in_state) ? CHARGING_COLOR : 0;
    case ROBOT_BATTERY: return battery_color(robot_.voltage(at));
    case ROBOT_SLEEPING: return sleep_rhythm_color(acts_at_, std::max(at, state_since_));
    default: return robot_.color;
    }
}

}  // namespace kilotwin
