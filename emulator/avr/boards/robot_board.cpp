#include "avr/boards/robot_board.h"

#include <algorithm>

#include "base/registers.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// Channels of the receiver, and pins (hardware.md 1.8).
constexpr uint8_t HIGH_GAIN = 0, LOW_GAIN = 1;
constexpr uint8_t IR_LED = 1 << 0, IR_LED_PINS = 1 << 0 | 1 << 1 | 1 << 2 | 1 << 6 | 1 << 7;
constexpr uint8_t LEFT_MOTOR_PIN = 3, RIGHT_MOTOR_PIN = 3;
constexpr uint8_t RECEIVER_POWER_PIN = 2;
constexpr uint16_t WATCHED[] = {DDRB,  PORTB,  DDRC,   PORTC, DDRD,
                                PORTD, TCCR2A, TCCR2B, OCR2A, OCR2B};
enum Traced : size_t { IR_OUT, IR_IN, MOTOR_LEFT, MOTOR_RIGHT, LED, PORT_B, PORT_C, PORT_D };

uint8_t bit(uint8_t value, int which) { return static_cast<uint8_t>(value >> which & 1); }

/// Pins of port B with an infrared LED: as calibrated, unless the mask is erased or names others.
uint8_t ir_led_pins(uint8_t mask) {
    return mask == 0 || (mask & ~IR_LED_PINS) != 0 ? IR_LED : mask;
}

/// Duty of a motor at an output of timer 2: the compare register, while the timer runs and drives
/// the pin.
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
    resets.clear();
}

RobotBoard::RobotBoard(const FlashImage &flash, uint32_t index, const Calibration &calibration,
                       Cycles power_up, const Chance &chance)
    : index_(index),
      clock_{power_up, calibration.tick},
      chance_(chance),
      chip_(*this, flash, eeprom_of(calibration)),
      ir_mask_(ir_led_pins(chip_.eeprom()[EEPROM_INFRARED_PINS])),
      converter_(chip_, [this](uint8_t channel) { return sample(channel); }) {
    // Timer 2 only drives the motors. simavr does not know its phase-correct mode and would spend
    // time on counting.
    for (uint16_t address : {TCCR2A, TCCR2B, OCR2A, OCR2B}) chip_.take_over(address);
    for (uint16_t address : WATCHED) chip_.watch_register(address, Microcontroller::Watch::CHANGES);
    set_charging(false);
}

void RobotBoard::run(Cycles until) { chip_.run(clock_.own_cycle(until)); }

void RobotBoard::shine(const LightPulse &pulse) {
    if (pulse.end <= pulse.begin) return;
    const uint64_t begin = std::max(clock_.own_cycle(pulse.begin), chip_.cycle());
    receiver_.add(begin, clock_.own_cycle(pulse.end), pulse.strength);
    chip_.set_alarm(Microcontroller::LIGHT_EDGE, receiver_.next());
}

/// Light on the receiver begins or ends at the chip's cycle.
void RobotBoard::pass_edges() {
    const bool was_lit = receiver_.lit();
    receiver_.pass(chip_.cycle());
    if (receiver_.next() != LightEdges::NONE)
        chip_.set_alarm(Microcontroller::LIGHT_EDGE, receiver_.next());
    if (receiver_.lit() == was_lit) return;
    if (receiver_on_) chip_.set_comparator(!was_lit);
    if (trace_) trace_->set(now(), IR_IN, !was_lit);
}

/// Without power the amplifiers pass nothing on to the comparator and the converter.
void RobotBoard::power_receiver(bool on) {
    if (on == receiver_on_) return;
    receiver_on_ = on;
    chip_.set_comparator(on && receiver_.lit());
}

int16_t RobotBoard::sample(uint8_t channel) {
    if (channel == HIGH_GAIN) return receiver_on_ ? receiver_.high() : 0;
    if (channel == LOW_GAIN) return receiver_on_ ? receiver_.low() : 0;
    if (sensor_on(channel) == nullptr) return 0;
    // The lowest bit is noise, which rand_hard() depends on (hardware.md 1.7).
    const int16_t reading = readings[channel];
    if (noise) return noise(channel, reading);
    const uint64_t bits = chance_.bits(index_, Purpose::CONVERTER_NOISE, conversions_++);
    return static_cast<int16_t>(reading + int(bits & 1) - int(bits >> 1 & 1));
}

void RobotBoard::register_written(uint16_t address) {
    if (address == ADCSRA)
        converter_.control_written();
    else
        update_outputs();
}

void RobotBoard::flag_set(uint8_t vector) { converter_.flag_set(vector); }

void RobotBoard::alarm(Microcontroller::Alarm alarm) {
    if (alarm == Microcontroller::LIGHT_EDGE)
        pass_edges();
    else
        converter_.conversion_ends();
}

void RobotBoard::serial_byte(uint8_t byte) { outputs.serial.push_back({now(), byte}); }

/// The chip alone was reset: light, charger and readings of the sensors are as they were.
void RobotBoard::was_reset(const WatchdogReset &reset) {
    if (reset.is_reported()) outputs.resets.push_back({now(), reset});
    converter_.was_reset();
    receiver_on_ = false;
    chip_.set_comparator(false);
    set_charging(charging_);
    update_outputs();
}

/// PD0 is low while the charger is at work (hardware.md 1.8).
void RobotBoard::set_charging(bool charging) {
    charging_ = charging;
    chip_.set_pin('D', 0, !charging);
}

/// LED, motors, infrared LED and receiver's power as the pins are now. Called for every change of a
/// watched register; outputs are noted only where they differ.
void RobotBoard::update_outputs() {
    const uint8_t ddrb = chip_.read(DDRB), ddrc = chip_.read(DDRC), ddrd = chip_.read(DDRD);
    const uint8_t portb = chip_.read(PORTB), portc = chip_.read(PORTC), portd = chip_.read(PORTD);
    // An LED lights while its pin is an output and low.
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
    power_receiver(bit(ddrd & portd, RECEIVER_POWER_PIN));
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
    trace_->set(now(), IR_IN, receiver_.lit());
    update_outputs();
}

}  // namespace kilotwin
