#include "avr/boards/module_board.h"

#include <algorithm>

#include "base/registers.h"
#include "runtime/core/eeprom_map.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// Wiring: kilogrid_modules/runtime/avr/board.h.
constexpr uint8_t IR_LED = 1 << 1, CAN_SELECT = 1 << 2;  // of port B
constexpr uint8_t IR_CELL_SHIFT = 3;                     // of port D
constexpr uint8_t RECEIVER_SHIFT = 1;                    // of port C: gain, then cell
constexpr uint8_t CELL_MASK = CELLS_PER_MODULE - 1;
constexpr uint8_t CAN_INTERRUPT_PIN = 2, RECEIVER_CHANNEL = 0;
constexpr uint8_t LED_DRIVER_ADDRESS = 0x15;

}  // namespace

// Places: kilogrid_modules/runtime, the EEPROM map (hardware.md 3.3).
EepromImage ModuleBoard::eeprom_of(uint8_t x, uint8_t y) {
    EepromImage image = kilotwin::eeprom_of(
        {TICK_CYCLES, UINT16_MAX, UINT8_MAX, UINT8_MAX, UINT8_MAX, UINT8_MAX, InfraredGains()});
    image[EEPROM_X] = x;
    image[EEPROM_Y] = y;
    return image;
}

ModuleBoard::ModuleBoard(const FlashImage &flash, uint32_t index, const EepromImage &eeprom,
                         Cycles tick, Cycles power_up, const Chance &chance)
    : index_(index),
      clock_{power_up, tick},
      chance_(chance),
      leds_(LED_DRIVER_ADDRESS),
      chip_(*this, flash, eeprom),
      converter_(chip_, [this](uint8_t channel) { return sample(channel); }),
      two_wire_(chip_, leds_) {
    for (uint16_t address : {DDRB, PORTB, PORTC, DDRD, PORTD})
        chip_.watch_register(address, Microcontroller::Watch::CHANGES);
    update_controller();
}

void ModuleBoard::run(Cycles until) { chip_.run(clock_.own_cycle(until)); }

// Light

void ModuleBoard::shine(uint8_t cell, const LightPulse &pulse) {
    if (pulse.end <= pulse.begin) return;
    const uint64_t begin = std::max(clock_.own_cycle(pulse.begin), chip_.cycle());
    receivers_[cell].add(begin, clock_.own_cycle(pulse.end), pulse.strength);
    pass_edges();
}

/// Light at any of the four receivers begins or ends at the chip's cycle.
void ModuleBoard::pass_edges() {
    uint64_t next = LightEdges::NONE;
    for (LightEdges &receiver : receivers_) {
        receiver.pass(chip_.cycle());
        next = std::min(next, receiver.next());
    }
    if (next != LightEdges::NONE) chip_.set_alarm(Microcontroller::LIGHT_EDGE, next);
    update_comparator();
}

void ModuleBoard::update_comparator() { chip_.set_comparator(receivers_[cell_].lit()); }

int16_t ModuleBoard::sample(uint8_t channel) {
    if (channel != RECEIVER_CHANNEL) return 0;
    constexpr int16_t MOST = 1023;
    const LightEdges &receiver = receivers_[cell_];
    // The lowest bit is noise, which rand_hard() depends on.
    const uint64_t bits = chance_.bits(index_, Purpose::MODULE_CONVERTER_NOISE, conversions_++);
    const int reading = (high_gain_ ? receiver.high() : receiver.low()) + int(bits & 1);
    return static_cast<int16_t>(std::min<int>(reading, MOST));
}

CellLight ModuleBoard::light(uint8_t cell) const {
    const unsigned first = 3u * cell;
    return {{leds_.light(first), leds_.light(first + 1), leds_.light(first + 2)}};
}

// Pins

void ModuleBoard::register_written(uint16_t address) {
    if (address == ADCSRA)
        converter_.control_written();
    else if (address == TWCR)
        two_wire_.control_written();
    else
        update_ports();
}

/// Chip select of the controller, both multiplexers and the infrared LED, as the pins are now.
void ModuleBoard::update_ports() {
    const uint8_t ddrb = chip_.read(DDRB), portb = chip_.read(PORTB), portc = chip_.read(PORTC);
    const bool selected = (ddrb & CAN_SELECT) != 0 && (portb & CAN_SELECT) == 0;
    if (selected != selected_) {
        selected_ = selected;
        if (selected) {
            controller_.select();
        } else {
            controller_.release();
            update_controller();
        }
    }
    high_gain_ = (portc >> RECEIVER_SHIFT & 1) != 0;
    const auto cell = static_cast<uint8_t>(portc >> (RECEIVER_SHIFT + 1) & CELL_MASK);
    if (cell != cell_) {
        cell_ = cell;
        update_comparator();
    }
    const bool ir = (ddrb & portb & IR_LED) != 0;
    if (ir == ir_on_) return;
    // The multiplexer is set before the LED is switched, so it is read only then.
    if (ir) ir_cell_ = static_cast<uint8_t>(chip_.read(PORTD) >> IR_CELL_SHIFT & CELL_MASK);
    ir_on_ = ir;
    lights.push_back({now(), ir_cell_, ir});
}

void ModuleBoard::alarm(Microcontroller::Alarm alarm) {
    switch (alarm) {
    case Microcontroller::LIGHT_EDGE: pass_edges(); break;
    case Microcontroller::CONVERSION: converter_.conversion_ends(); break;
    case Microcontroller::TWO_WIRE: two_wire_.step_ends(); break;
    default: take_arrivals(); break;
    }
}

void ModuleBoard::was_reset(const WatchdogReset &reset) {
    if (reset.is_reported()) resets.push_back({now(), reset});
    converter_.was_reset();
    two_wire_.was_reset();
    // The watchdog resets the chip alone: controller and LED driver keep their state.
    selected_ = false;
    controller_.release();
    update_comparator();
    update_ports();
    update_controller();
}

// CAN

uint8_t ModuleBoard::spi_exchange(uint8_t byte) {
    const uint8_t answer = controller_.exchange(byte);
    update_controller();
    return answer;
}

/// Passes on the controller's interrupt pin, and a frame that it has to send.
void ModuleBoard::update_controller() {
    chip_.set_pin('D', CAN_INTERRUPT_PIN, !controller_.interrupts());
    if (const auto frame = controller_.next_to_send()) can_frames.push_back({now(), *frame});
}

/// Frames end in order of time, so the first in the queue is the next.
void ModuleBoard::arrive(const Arrival &arrival) {
    arrivals_.push(arrival);
    chip_.set_alarm(Microcontroller::FRAME, arrivals_.front().cycle);
}

void ModuleBoard::receive_can(Cycles at, const CanFrame &frame) {
    arrive({clock_.own_cycle(at), false, frame});
}

void ModuleBoard::frame_sent(Cycles at) { arrive({clock_.own_cycle(at), true, {}}); }

void ModuleBoard::frame_lost() {
    controller_.gives_up();
    update_controller();
}

/// Hands the controller everything that has ended on the bus up to the chip's cycle.
void ModuleBoard::take_arrivals() {
    while (!arrivals_.empty() && arrivals_.front().cycle <= chip_.cycle()) {
        if (arrivals_.front().is_own)
            controller_.sent();
        else
            controller_.receive(arrivals_.front().frame);
        arrivals_.pop();
    }
    if (!arrivals_.empty()) chip_.set_alarm(Microcontroller::FRAME, arrivals_.front().cycle);
    update_controller();
}

void ModuleBoard::set_can_errors(uint32_t transmit, uint32_t receive, bool bus_off) {
    controller_.set_errors(transmit, receive, bus_off);
    update_controller();
}

}  // namespace kilotwin
