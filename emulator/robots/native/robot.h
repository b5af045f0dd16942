/// A robot whose program is native: the emulator's driver of firmware/kilolib/core around one
/// program.
///
/// The core holds what the robot's runtime decides: states, commands, the transmit clock. This
/// class supplies what the chip has beside it: time, interrupts, registers, sensors, EEPROM. Time
/// is the hardware's (hardware.md 1.2 to 1.6): a tick each 32.768 ms of the robot's own oscillator,
/// callbacks where an interrupt would come, `delay()` that lets time pass. The program itself takes
/// no time. A robot is run ahead up to a moment before which nothing from outside can reach it; its
/// outputs are a list with their times, the same however far it is run at once.
///
/// Sources: robot.cpp (running: ticks, interrupts, loop()), commands.cpp (messages, and the states
/// that commands lead to), calls.cpp (what its program calls, and outputs).
#ifndef KILOTWIN_ROBOTS_NATIVE_ROBOT_H
#define KILOTWIN_ROBOTS_NATIVE_ROBOT_H

#include <cstdint>
#include <cstring>
#include <string>

#include "base/memory.h"
#include "robots/native/guest.h"
#include "robots/native/serial_line.h"
#include "robots/record.h"

namespace kilotwin {

/// State of a native robot besides its record, its guest and its variables.
struct NativeRobotState {
    /// State of few robots: those that received answers to a host, printed by the serial line, or
    /// read their gains from an EEPROM that was written to.
    struct Rare {
        Own<gain_tables_t> gains;  ///< null: those of its calibration
        robot_heard_t heard;
        SerialLine serial;
    };

    Own<Rare> rare_;          ///< by written()
    Cycles state_since_ = 0;  ///< for the light of states
    Cycles acts_at_ = 0;      ///< when the main loop sees the state, or a setup() that waits goes
                              ///< on; of SLEEPING: when it last went down (sleep_rhythm.h)
    int16_t stale_conversion_ =
        -1;  ///< of get_voltage(): the next message's high gain is read from its channel
    uint16_t period_ = TX_PERIOD_DEFAULT;  ///< kilo_tx_period of a program that settles it
};

class alignas(64) NativeRobot final : public NativeGuest, private NativeRobotState {
  public:
    /// A robot's state at a moment, but for its record.
    struct Kept {
        GuestState guest;
        NativeRobotState robot;
        std::vector<uint8_t> variables;
    };

    /// `image`, program.state_bytes() long, is its own. Both it and `robot` must stay where they
    /// are.
    NativeRobot(Program &program, RobotRecord &robot, uint8_t *image);

    /// As Driver::run(), next_ask(), color() and variables().
    void run();
    void count_on(uint32_t ticks);  ///< as Driver::count_on()
    Cycles next_ask() const;
    uint8_t color(Cycles at) const;
    std::vector<uint8_t> variables() const { return program_->state_of(image_); }

    // As Driver::keep(), restore() and can_undo().
    void keep(Kept &kept) const;
    void restore(const Kept &kept);
    bool can_undo() const { return !stack().keeps_float_control(&robot_.now); }

  private:
    using Question = RobotRecord::Question;

    // The guest's.
    void live() override;
    void init() override;
    void start() override { robot_.life = RobotRecord::Life::ALIVE; }
    void wait_until(Cycles wake) override;
    void tick() override;
    void interrupts_changed() override { robot_.only_ticks_until = 0; }
    void outputs_changed() override;
    uint64_t random_bits() override;
    int16_t sensor(uint8_t channel) override;
    uint8_t distance_mm(distance_measurement_t measured) const override;
    uint8_t eeprom(uint16_t address) const override { return robot_.eeprom(address); }
    void set_eeprom(uint16_t address, uint8_t value) override { robot_.set_eeprom(address, value); }
    void print(const char *text, uint32_t bytes, uint8_t line) override;
    void serial_written() override;
    void serial_ready() override;
    bool is_stopped() const override { return robot_.life == RobotRecord::Life::STOPPED; }
    bool restarts(const CodePath &code) override;
    void stop(EventKind kind, std::string text, CodePath code = {}) override;
    void report(EventKind kind, std::string text, CodePath code = {}) override {
        robot_.report(kind, std::move(text), std::move(code));
    }
    uint8_t &noted() override { return robot_.noted; }

    // Running.
    void set_up();    ///< SETUP: setup(), once
    void run_loop();  ///< loop(), again and again while only ticks happen
    void count_tick(volatile uint32_t &ticks);
    Cycles next_request() const;  ///< of the program for a message
    const volatile uint16_t &tx_period(const kt_table_t &table) const;
    bool message_comes_next() const {
        return robot_.next_message < std::min(robot_.next_tick, robot_.until);
    }
    /// Up to here only ticks happen.
    Cycles quiet_until() const { return std::min(robot_.next_message, robot_.until); }
    /// Whether the timer counts on to an ordinary tick before `until`, and no answer is due.
    bool plain_tick_before(Cycles until) const {
        return robot_.next_tick < until && robot_.ticks_are_ordinary() && !interrupts_off_ &&
               robot_.core.answer.attempts == 0;
    }
    Cycles only_ticks_until(Cycles until) const {
        return plain_tick_before(until) && robot_.now <= robot_.next_tick ? until : 0;
    }
    void serve_interrupt();  ///< the one that is due: a message, or a tick
    void ask_for_message(const kt_table_t &table);
    void try_to_answer(const kt_table_t &table);  ///< a question to the runtime
    /// A frame begins now; without `granted` the channel is asked first. False if that is busy.
    bool put_on_air(const message_t &message, bool granted);
    bool ask_medium(Question question);
    bool may_be_asked();  ///< its program, for a message
    void retry_soon();    ///< back-off: the timer's next match is at a random count
    /// Calls the program as an interrupt would: interrupts off, a budget of its own.
    template <typename Callback> void interrupt(const kt_table_t &table, Callback callback);

    // Messages and commands.
    void take_message();  ///< the first of the inbox: a command, or the program's
    void write_down(const Reception &reception) const;  ///< of a robot that is listened to
    bool receives(const Reception &reception);
    void obey(const message_t &message);
    void start_motion();
    void enter_state(robot_state_t before);
    Cycles main_loop_sees(robot_state_t before) const;  ///< the state that it has got now
    void save_calibration(const message_t &message);
    void gains_saved(uint8_t which, uint8_t *content) const;  ///< as the answer has them
    void read_gains();                                        ///< as a program that starts does
    void start_again();

    // Outputs.
    void look_at_outputs() { look_at_outputs(*table().outputs, table().settle); }
    void look_at_outputs(const volatile kt_outputs_t &outputs, void (*settle)());
    void take_outputs(uint64_t seen);
    void switch_motors(bool on);
    void set_duties(motion_t duties);
    void switch_led_off();
    void wait_for_line(Cycles until);
    Rare &written();  ///< made when it is needed for the first time

    RobotRecord &robot_;
};

/// Looks at what the registers now make of motors and LED; `settle` is the table's, or null.
inline void NativeRobot::look_at_outputs(const volatile kt_outputs_t &outputs, void (*settle)()) {
    if (settle != nullptr) [[unlikely]]
        settle();
    uint64_t seen;
    static_assert(sizeof seen == sizeof outputs);
    std::memcpy(&seen, const_cast<const kt_outputs_t *>(&outputs), sizeof seen);
    if (seen != robot_.outputs_seen) [[unlikely]]
        take_outputs(seen);
}

}  // namespace kilotwin

#endif
