/// One Kilobot that runs its .hex: the ATmega328P and the circuit around it (hardware.md 1.8).
///
/// Infrared goes in and out bit by bit: in as light on the comparator and the two amplifiers, out
/// as pulses of the LED. Which boards see which light is decided outside. All times are world time;
/// the board's own oscillator deviates as its calibration says. A board belongs to one thread.
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
#include "avr/chip/watchdog_reset.h"
#include "base/board_clock.h"
#include "base/chance.h"
#include "base/clock.h"
#include "infrared/light_edges.h"
#include "robots/robot.h"
#include "robots/sensors.h"

namespace kilotwin {

/// Outputs of a board in order of time, appended by run(); the caller takes and clears them.
struct BoardOutputs {
    /// The infrared LED going on or off.
    struct Light {
        Cycles at;
        bool on;
    };
    struct Color {
        Cycles at;
        uint8_t rgb;  ///< RGB() value
    };
    /// A byte that the UART sends.
    struct Serial {
        Cycles at;
        uint8_t byte;
    };
    std::vector<Light> light;
    std::vector<MotorCommand> motors;  ///< whenever either duty changes
    std::vector<Color> colors;         ///< of the RGB LED
    std::vector<Serial> serial;
    std::vector<ReportedReset> resets;  ///< by the watchdog

    /// Empties all five; their memory stays.
    void clear();
};

class RobotBoard : private Microcontroller::Board {
  public:
    /// Length of a pulse of a Kilobot's LED at the comparator, stretched by the receiver's
    /// amplifier.
    static constexpr Cycles SEEN_PULSE = 40;

    /// Switches robot `index` on at `power_up`, with `flash` programmed and
    /// `eeprom_of(calibration)`. `chance` must live on; the images are copied.
    RobotBoard(const FlashImage &flash, uint32_t index, const Calibration &calibration,
               Cycles power_up, const Chance &chance);

    /// Runs up to `until`, plus the rest of the instruction begun. Cheap while the program idles.
    void run(Cycles until);

    /// Up to when run() would do nothing that shows, if nothing comes from outside meanwhile;
    /// NEVER: for ever. 0, or the past, if that is not known.
    Cycles rests_until() const {
        const uint64_t cycle = chip_.rests_until();
        return cycle == Microcontroller::NO_ALARM ? NEVER : clock_.world_time(cycle);
    }
    /// The time that it has been run up to.
    Cycles now() const { return clock_.world_time(chip_.cycle()); }

    /// Lets light fall on the receiver; `pulse.begin` is not earlier than now(). Overlapping pulses
    /// make one that ends with the last, and their strengths add up. Empty pulses are ignored.
    void shine(const LightPulse &pulse);

    uint8_t color() const { return color_; }  ///< RGB() value of the LED
    /// Duties of the motors as they are driven now, 0..255; 0 while a pin is no output.
    uint8_t left_duty() const { return left_; }
    uint8_t right_duty() const { return right_; }

    /// Why the program cannot go on; empty while it can. "tick" in it counts from power-up.
    const std::string &failure() const { return chip_.failure(); }
    void switch_off() { chip_.switch_off(); }  ///< for good
    /// Where that came about; empty without a failure.
    const CodePath &failure_code() const { return chip_.failure_code(); }

    uint64_t cycle() const { return chip_.cycle(); }  ///< cycles of its own since power-up

    /// Nominal ticks of 262,144 of its cycles since power-up.
    uint32_t tick() const { return static_cast<uint32_t>(chip_.cycle() / TICK_CYCLES); }

    // Memory: SRAM and registers, flash, EEPROM, without side effects.
    uint8_t read(uint16_t address) const { return chip_.read(address); }
    bool carry() const { return chip_.carry(); }  ///< the flag
    void write(uint16_t address, uint8_t value) { chip_.write(address, value); }
    uint8_t flash(uint16_t address) const { return chip_.flash(address); }
    const std::array<uint8_t, FlashImage::BYTES> &flash_content() const {
        return chip_.flash_content();
    }
    uint32_t flash_operations() const { return chip_.flash_operations(); }
    EepromImage eeprom() const { return chip_.eeprom(); }

    // For tests and profiles; see Microcontroller.
    void start_at_boot_section() { chip_.start_at_boot_section(); }
    /// Executes waits instruction by instruction: slower, with the same result.
    void skip_nothing() { chip_.skip_nothing(); }
    /// Calls `follower` around each instruction; it must live on.
    void follow(Microcontroller::Follower &follower) { chip_.follow(follower); }

    /// Opens 127.0.0.1:`port` for gdb, and waits for it before the next instruction.
    void listen_for_debugger(uint16_t port) { chip_.listen_for_debugger(port); }
    void serve_debugger() { chip_.serve_debugger(); }

    /// Writes its pins from now on to a VCD file. Throws EngineError if the file cannot be written.
    void trace(const std::string &path);

    /// Readings of the sensors from now on, without noise; set from outside.
    Readings readings = usual_readings();

    /// Replaces the noise of the lowest bit in readings of the sensors, if set: maps a reading to
    /// the conversion's result.
    std::function<int16_t(uint8_t channel, int16_t reading)> noise;

    /// Puts it on the charger or takes it off.
    void set_charging(bool charging);

    BoardOutputs outputs;

  private:
    void register_written(uint16_t address) override;
    void flag_set(uint8_t vector) override;
    void alarm(Microcontroller::Alarm alarm) override;
    void serial_byte(uint8_t byte) override;
    void was_reset(const WatchdogReset &reset) override;
    void quiet_sleep() override { converter_.quiet_sleep(); }

    int16_t sample(uint8_t channel);  ///< reading of a converter's channel, 0..1023
    void power_receiver(bool on);
    void update_outputs();
    void pass_edges();

    uint32_t index_;
    BoardClock clock_;
    const Chance &chance_;
    Microcontroller chip_;
    uint8_t ir_mask_;  ///< pins of port B that drive the infrared LED
    Converter converter_;
    LightEdges receiver_;
    uint64_t conversions_ = 0;  ///< draws of noise so far
    bool ir_on_ = false;        ///< its infrared LED
    bool charging_ = false;
    bool receiver_on_ = false;  ///< its amplifiers have power
    uint8_t color_ = 0, left_ = 0, right_ = 0;
    std::unique_ptr<VcdTrace> trace_;
};

}  // namespace kilotwin

#endif
