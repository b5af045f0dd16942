#include "avr/robot_board.h"

#include <algorithm>

#include "avr/registers.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr uint8_t HIGH_GAIN = 0, LOW_GAIN = 1, BATTERY = 6, AMBIENT_LIGHT = 7, TEMPERATURE = 8;
constexpr uint8_t IR_LED = 1 << 0;
constexpr uint8_t LEFT_MOTOR_PIN = 3, RIGHT_MOTOR_PIN = 3;
constexpr uint16_t WATCHED[] = {DDRB,  PORTB,  DDRC,   PORTC, DDRD,
                                PORTD, TCCR2A, TCCR2B, OCR2A, OCR2B};
enum Traced : size_t { IR_OUT, IR_IN, MOTOR_LEFT, MOTOR_RIGHT, LED, PORT_B, PORT_C, PORT_D };

uint8_t bit(uint8_t value, int which) { return static_cast<uint8_t>(value >> which & 1); }

/// Duty of a motor at an output of timer 2: the compare register's, while the timer runs and drives the pin.
uint8_t duty(bool output, bool level, uint8_t compare_mode, bool runs, uint8_t compare) {
    constexpr uint8_t NON_INVERTING = 2;
    if (!output) return 0;
    if (compare_mode == NON_INVERTING && runs) return compare;
    return level ? UINT8_MAX : 0;
}

}  // namespace

void BoardOutputs::clear() {
    light.clear();
    motors.clear();
    colors.clear();
    serial.clear();
}

RobotBoard::RobotBoard(const FlashImage &flash, uint32_t index, const Calibration &calibration,
                       Cycles power_up, const Chance &chance)
    : index_(index),
      power_up_(power_up),
      tick_(calibration.tick),
      ir_mask_(IR_LED),
      chance_(chance),
      chip_(*this, flash, eeprom_of(calibration)),
      converter_(chip_, [this](uint8_t channel) { return sample(channel); }) {
    // Timer 2 only drives the motors. simavr does not know its phase-correct mode and would count in vain.
    for (uint16_t address : {TCCR2A, TCCR2B, OCR2A, OCR2B}) chip_.take_over(address);
    for (uint16_t address : WATCHED) chip_.watch_register(address, Microcontroller::Watch::CHANGES);
    set_charging(false);
}

// The board's clock counts TICK_CYCLES in what are tick_ of the world's cycles.
Cycles RobotBoard::world_time(uint64_t cycle) const {
    return power_up_ + cycle / TICK_CYCLES * tick_ + cycle % TICK_CYCLES * tick_ / TICK_CYCLES;
}

/// The first of its cycles that is not before `at`.
uint64_t RobotBoard::own_cycle(Cycles at) const {
    if (at <= power_up_) return 0;
    const Cycles age = at - power_up_;
    return age / tick_ * TICK_CYCLES + (age % tick_ * TICK_CYCLES + tick_ - 1) / tick_;
}

void RobotBoard::run(Cycles until) { chip_.run(own_cycle(until)); }

void RobotBoard::shine(const LightPulse &pulse) {
    if (pulse.end <= pulse.begin) return;
    const uint64_t begin = std::max(own_cycle(pulse.begin), chip_.cycle());
    edges_.push({begin, true, pulse.strength});
    edges_.push({std::max(own_cycle(pulse.end), begin + 1), false, pulse.strength});
    chip_.set_alarm(Microcontroller::LIGHT_EDGE, edges_.top().cycle);
}

/// Light goes on or off. At one moment what begins comes before what ends, so light that is passed on
/// from one pulse to the next does not flicker.
void RobotBoard::pass_edges() {
    const bool was_lit = lit_ > 0;
    while (!edges_.empty() && edges_.top().cycle <= chip_.cycle()) {
        const Edge &edge = edges_.top();
        const int32_t sign = edge.on ? 1 : -1;
        lit_ += static_cast<uint32_t>(sign);
        low_ += sign * edge.strength.low_gain;
        high_ += sign * edge.strength.high_gain;
        edges_.pop();
    }
    if (!edges_.empty()) chip_.set_alarm(Microcontroller::LIGHT_EDGE, edges_.top().cycle);
    if ((lit_ > 0) == was_lit) return;
    chip_.set_comparator(lit_ > 0);
    if (trace_) trace_->set(now(), IR_IN, lit_ > 0);
}

int16_t RobotBoard::sample(uint8_t channel) {
    constexpr int32_t MOST = 1023;
    // The lowest bit is never still: rand_hard() lives on that (hardware.md 1.7).
    auto noisy = [&](int16_t reading) {
        if (noise) return noise(channel, reading);
        const uint64_t bits = chance_.bits(index_, Purpose::CONVERTER_NOISE, conversions_++);
        return static_cast<int16_t>(reading + int(bits & 1) - int(bits >> 1 & 1));
    };
    switch (channel) {
    case HIGH_GAIN: return static_cast<int16_t>(std::min(high_, MOST));
    case LOW_GAIN: return static_cast<int16_t>(std::min(low_, MOST));
    case BATTERY: return noisy(battery);
    case AMBIENT_LIGHT: return noisy(light);
    case TEMPERATURE: return noisy(temperature);
    default: return 0;
    }
}

void RobotBoard::register_written(uint16_t address) {
    if (address == ADCSRA)
        converter_.control_written();
    else
        look_at_outputs();
}

void RobotBoard::flag_set(uint8_t) { converter_.comparator_tripped(); }

void RobotBoard::alarm(Microcontroller::Alarm alarm) {
    if (alarm == Microcontroller::LIGHT_EDGE)
        pass_edges();
    else
        converter_.conversion_ends();
}

void RobotBoard::serial_byte(uint8_t byte) { outputs.serial.push_back({now(), byte}); }

void RobotBoard::was_reset() {
    converter_.was_reset();
    chip_.set_comparator(lit_ > 0);
    set_charging(charging_);
    look_at_outputs();
}

void RobotBoard::set_charging(bool charging) {
    charging_ = charging;
    chip_.set_pin('D', 0, !charging);
}

void RobotBoard::look_at_outputs() {
    const uint8_t ddrb = chip_.read(DDRB), ddrc = chip_.read(DDRC), ddrd = chip_.read(DDRD);
    const uint8_t portb = chip_.read(PORTB), portc = chip_.read(PORTC), portd = chip_.read(PORTD);
    auto lit = [](uint8_t ddr, uint8_t port, int pin) {
        return bit(ddr, pin) & ~bit(port, pin) & 1;
    };
    const auto color = static_cast<uint8_t>(lit(ddrd, portd, 5) | lit(ddrd, portd, 4) << 1 |
                                            lit(ddrc, portc, 3) << 2 | lit(ddrc, portc, 2) << 3 |
                                            lit(ddrc, portc, 5) << 4 | lit(ddrc, portc, 4) << 5);
    const uint8_t modes = chip_.read(TCCR2A);
    const bool runs = (chip_.read(TCCR2B) & 7) != 0;
    const uint8_t left = duty(bit(ddrb, LEFT_MOTOR_PIN), bit(portb, LEFT_MOTOR_PIN), modes >> 6,
                              runs, chip_.read(OCR2A));
    const uint8_t right = duty(bit(ddrd, RIGHT_MOTOR_PIN), bit(portd, RIGHT_MOTOR_PIN),
                               modes >> 4 & 3, runs, chip_.read(OCR2B));
    const bool ir = (ddrb & portb & ir_mask_) != 0;
    const Cycles at = now();
    if (ir != ir_on_) outputs.light.push_back({at, ir});
    if (color != color_) outputs.colors.push_back({at, color});
    if (left != left_ || right != right_) outputs.motors.push_back({at, left, right});
    ir_on_ = ir;
    color_ = color;
    left_ = left;
    right_ = right;
    if (!trace_) return;
    trace_->set(at, IR_OUT, ir);
    trace_->set(at, MOTOR_LEFT, left);
    trace_->set(at, MOTOR_RIGHT, right);
    trace_->set(at, LED, color);
    trace_->set(at, PORT_B, ddrb & portb);
    trace_->set(at, PORT_C, ddrc & portc);
    trace_->set(at, PORT_D, ddrd & portd);
}

void RobotBoard::trace(const std::string &path) {
    trace_ = std::make_unique<VcdTrace>(path, "robot_" + std::to_string(index_),
                                        std::vector<VcdTrace::Signal>{{"ir_out", 1},
                                                                      {"ir_in", 1},
                                                                      {"motor_left", 8},
                                                                      {"motor_right", 8},
                                                                      {"led", 6},
                                                                      {"port_b", 8},
                                                                      {"port_c", 8},
                                                                      {"port_d", 8}});
    trace_->set(now(), IR_IN, lit_ > 0);
    look_at_outputs();
}

}  // namespace kilotwin
