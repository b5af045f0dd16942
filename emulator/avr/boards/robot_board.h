/// One Kilobot from its very .hex: the ATmega328P and what is wired to it (hardware.md 1.8).
///
/// Infrared goes in and out bit by bit, as light on the comparator and the two amplifiers, and as pulses of the
/// LED; whoever couples boards decides who sees whom. Times are the world's; the board's own oscillator may be
/// off, as its calibration says.
#ifndef KILOTWIN_AVR_BOARDS_ROBOT_BOARD_H
#define KILOTWIN_AVR_BOARDS_ROBOT_BOARD_H

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "avr/chip/converter.h"
#include "avr/chip/flash_image.h"
#include "avr/chip/microcontroller.h"
#include "avr/chip/vcd_trace.h"
#include "base/chance.h"
#include "base/clock.h"
#include "guest/robot.h"
#include "infrared/light_edges.h"

namespace kilotwin {

/// What a board did, in order of time. The caller clears it.
struct BoardOutputs {
    struct Light {
        Cycles at;
        bool on;
    };
    struct Color {
        Cycles at;
        uint8_t rgb;  ///< RGB() value
    };
    struct Serial {
        Cycles at;
        uint8_t byte;
    };
    std::vector<Light> light;  ///< of its IR LED
    std::vector<MotorCommand> motors;
    std::vector<Color> colors;
    std::vector<Serial> serial;

    void clear();
};

class RobotBoard : private Microcontroller::Board {
  public:
    /// A pulse from a Kilobot's LED, as the receiver's amplifier shows it to the comparator.
    static constexpr Cycles SEEN_PULSE = 40;

    /// Robot `index` is switched on at `power_up` with `flash` programmed and `eeprom_of(calibration)`.
    /// `chance` must live on.
    RobotBoard(const FlashImage &flash, uint32_t index, const Calibration &calibration,
               Cycles power_up, const Chance &chance);

    /// Lives through everything before `until`, plus what is left of the instruction begun.
    void run(Cycles until);

    /// The time it has been run up to.
    Cycles now() const { return clock_.world_time(chip_.cycle()); }

    /// Lets light fall on the receiver; `pulse.begin` is not earlier than now(). Pulses may overlap: the light
    /// then lasts until the last of them ends, and its strengths add up.
    void shine(const LightPulse &pulse);

    uint8_t color() const { return color_; }  ///< RGB() value shown
    uint8_t left_duty() const { return left_; }
    uint8_t right_duty() const { return right_; }

    /// Why it stands still for ever: its program crashed. Empty while it runs. "tick" in it counts from power-up.
    const std::string &failure() const { return chip_.failure(); }

    uint64_t cycle() const { return chip_.cycle(); }  ///< its own, since power-up

    /// Nominal ticks of 262,144 of its cycles since power-up.
    uint32_t tick() const { return static_cast<uint32_t>(chip_.cycle() / TICK_CYCLES); }

    uint8_t read(uint16_t address) const { return chip_.read(address); }  ///< SRAM or a register
    void write(uint16_t address, uint8_t value) { chip_.write(address, value); }
    uint8_t flash(uint16_t address) const { return chip_.flash(address); }
    EepromImage eeprom() const { return chip_.eeprom(); }

    void skip_nothing() { chip_.skip_nothing(); }  ///< for tests, see Microcontroller
    void follow(Microcontroller::Follower &follower) { chip_.follow(follower); }

    /// Waits for gdb on 127.0.0.1:`port` before the next instruction.
    void serve_debugger(uint16_t port) { chip_.serve_debugger(port); }

    /// Writes what its pins do from now on to a VCD file.
    void trace(const std::string &path);

    // What the sensors read from now on, 0..1023; set from outside.
    int16_t light = 0, battery = 720, temperature = 300;

    /// What battery, ambient light and temperature (hardware.md 1.8: channels 6, 7 and 8) are converted to, in
    /// place of the reading with a lowest bit that is never still.
    std::function<int16_t(uint8_t channel, int16_t reading)> noise;

    /// On the charger or off it.
    void set_charging(bool charging);

    BoardOutputs outputs;

  private:
    void register_written(uint16_t address) override;
    void flag_set(uint8_t vector) override;
    void alarm(Microcontroller::Alarm alarm) override;
    void serial_byte(uint8_t byte) override;
    void was_reset() override;
    void quiet_sleep() override { converter_.quiet_sleep(); }

    int16_t sample(uint8_t channel);
    void power_receiver(bool on);
    void look_at_outputs();
    void pass_edges();

    uint32_t index_;
    BoardClock clock_;
    const Chance &chance_;
    Microcontroller chip_;
    uint8_t ir_mask_;  ///< of port B
    Converter converter_;
    LightEdges receiver_;
    uint64_t conversions_ = 0;
    bool ir_on_ = false, charging_ = false;
    bool receiver_on_ = false;  ///< the amplifiers have power
    uint8_t color_ = 0, left_ = 0, right_ = 0;
    std::unique_ptr<VcdTrace> trace_;
};

}  // namespace kilotwin

#endif
