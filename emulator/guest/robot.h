/// A robot as a guest: the emulator's driver of firmware/kilolib/core around one program.
///
/// The core holds what the robot's runtime decides: states, commands, the transmit clock. This
/// class supplies what the chip has beside it: time, interrupts, registers, sensors, EEPROM. Time
/// is the hardware's (hardware.md 1.2 to 1.6): a tick each 32.768 ms of the robot's own oscillator,
/// callbacks where an interrupt would come, `delay()` that lets time pass. The program itself takes
/// no time. A robot is run ahead up to a moment before which nothing from outside can reach it; its
/// outputs are a list with their times, the same however far it is run at once.
///
/// A program that is translated (program.h) runs by its machine code, with its own runtime and
/// time: translated_robot.h.
///
/// Sources: robot.cpp (running: ticks, interrupts, loop()), robot_inputs.cpp (what reaches it),
/// robot_calls.cpp (what its program calls), robot_outputs.cpp (what it shows); native programs.
#ifndef KILOTWIN_GUEST_ROBOT_H
#define KILOTWIN_GUEST_ROBOT_H

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/chance.h"
#include "base/clock.h"
#include "base/events.h"
#include "base/memory.h"
#include "base/motor_command.h"
#include "base/prefetch.h"
#include "guest/busy_watch.h"
#include "guest/eeprom.h"
#include "guest/infrared_gains.h"
#include "guest/program.h"
#include "guest/serial_line.h"
#include "guest/stack.h"
#include "guest/timer.h"
#include "kilolib/core/robot_commands.h"

namespace kilotwin {

/// A frame that a robot receives; delivered when it ends.
struct Reception {
    Cycles at;  ///< end of the frame
    message_t message;
    distance_measurement_t distance;
};

/// A frame that a robot sends.
struct Emission {
    Cycles at;       ///< begin of the frame
    uint32_t robot;  ///< index
    message_t message;
};

/// Which robot runs, for the report if its program kills the process. Survives that when it is a
/// mapped file.
struct BlackBox {
    uint32_t robot;  ///< index
    uint32_t tick;   ///< its kilo_ticks at the last tick
};

/// Shared by all robots of a simulation.
struct RobotContext {
    const Chance &chance;
    Events &events;
    std::vector<Emission> &emissions;  ///< of granted attempts; each robot's in order of time
    BlackBox *black_box = nullptr;     ///< may be null
    Cycles frame = 0;                  ///< how long sending keeps a robot busy; 0 with `ideal`
    bool gains_are_mm = true;          ///< the medium reports the distance itself, as both gains
    Cycles battery = 0;                ///< how long it drives on a full battery; 0: for ever
    int16_t temperature = 300;         ///< reading, 0..1023
    bool recalls_passes = true;        ///< of translated programs, those that change nothing
};

/// One per robot, on a board or not. The channel executes those with a program.
class alignas(64) Robot {
  public:
    /// Robot `index`, switched on at `power_up`. `image` holds its state: program.state_bytes()
    /// bytes of its own.
    Robot(RobotContext &context, Program &program, uint32_t index, const Calibration &calibration,
          Cycles power_up, uint8_t *image);

    /// A robot whose program runs on a board: this object holds its inputs and outputs, and run()
    /// does nothing. `name`, its program's, must outlive it.
    Robot(RobotContext &context, const std::string &name, uint32_t index,
          const Calibration &calibration, Cycles power_up);
    ~Robot();
    Robot(Robot &&) = default;
    Robot(const Robot &) = delete;
    Robot &operator=(const Robot &) = delete;

    /// Each thread calls it once before it runs robots.
    static void serve_this_thread();

    /// Brings the robot, then its state and inbox, into the cache before a run.
    void prefetch() const { prefetch_bytes(this, OFTEN_USED_BYTES); }
    void prefetch_state() const {
        prefetch_line(inbox_.data());
        if (!on_board()) prefetch_bytes(image_, program_->state_bytes());
    }

    /// Prefetch the fields of receive(), and those of disturb() and the gains as well.
    void prefetch_receiver() const {
        prefetch_line(&next_message_);
        prefetch_line(&inbox_);
        prefetch_line(&inbox_ + 1);  // it ends on another line
    }
    void prefetch_light() const {
        prefetch_receiver();
        prefetch_line(this);
        prefetch_line(&frames_seen_);
        prefetch_line(&calibration_);
    }

    /// Runs the robot through everything strictly before `until`. Every attempt to send succeeds.
    void run(Cycles until);

    /// The same, but it stops where the program is about to be requested for a message, or sends
    /// one: then the channel decides by answer(). Returns the time run up to: `until`, or that of
    /// the question.
    enum class Question : uint8_t { NONE, MAY_ASK, IS_CHANNEL_FREE };
    Cycles run_arbitrated(Cycles until);
    Question question() const { return question_; }  ///< the one that waits for answer()
    Cycles now() const { return now_; }              ///< the time run up to

    /// Answers both questions with yes beforehand, should they come up from `first` to `last` in
    /// the next run. The frame is appended to the context's emissions, and the robot runs on until
    /// `until`: nothing reaches a robot that sends.
    void grant(Cycles first, Cycles last, Cycles until) {
        granted_from_ = first;
        granted_to_ = last;
        granted_until_ = until;
    }

    /// Answers MAY_ASK (no: a frame is being received; the next attempt is at the next tick) or
    /// IS_CHANNEL_FREE (no: the attempt failed; it backs off). The next run goes on from there.
    void answer(bool yes);

    /// After IS_CHANNEL_FREE: the message of the attempt.
    const message_t &outgoing() const { return outgoing_; }

    /// Lookahead: the earliest moment at which the program may be requested for a message, or its
    /// runtime answers a question; NEVER if only a command changes that. Constant time.
    Cycles next_ask() const;

    /// Puts a message whose frame ends at `at`, not earlier than the time run up to, into the
    /// inbox. Any order; cheapest in order of time.
    void receive(Cycles at, const message_t &message, distance_measurement_t distance);

    /// The same of a message that is no light, but comes beside the medium: it is never missed,
    /// also if others come at the same time.
    void tell(Cycles at, const message_t &message);

    /// A frame is being received from `begin` to `end`: meanwhile sensors return -1, and the edges
    /// of its light take time from a translated program.
    void disturb(Cycles begin, Cycles end, const message_t &message);

    // For a board: takes the inbox out, in order of time; notes what the board's pins do, and a
    // crash.
    Few<Reception, 2> take_inbox() {
        next_message_ = NEVER;
        return std::exchange(inbox_, {});
    }
    void drive(const MotorCommand &command);
    void show(uint8_t color) { color_ = color; }
    void print(Cycles at, uint32_t tick, std::string text);
    void remark(Cycles at, uint32_t tick, std::string text);  ///< a NOTE
    void crash(Cycles at, uint32_t tick, std::string text, CodePath code);

    /// Converter reading of its battery, 0..1023.
    int16_t voltage(Cycles at) const;

    // Identity and state, for reading at any time.
    uint32_t index() const { return index_; }
    uint16_t uid() const { return calibration_.uid; }
    uint8_t color(Cycles at) const;  ///< RGB() value shown at `at`, the time run up to
    bool stopped() const { return life_ == Life::STOPPED; }  ///< its program failed
    const Calibration &calibration() const { return calibration_; }
    bool on_board() const { return program_ == nullptr; }
    const Program &program() const { return *program_; }  ///< not of one on a board

    /// Copy of its program's variables; empty for a robot on a board.
    std::vector<uint8_t> state() const {
        return program_ ? program_->state_of(image_) : std::vector<uint8_t>{};
    }

    /// Duties of its motors as they are driven now, 0..255.
    uint8_t left_duty() const { return left_; }
    uint8_t right_duty() const { return right_; }

  private:
    /// STOPPED: its program crashed or never came back; it stays where it is.
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };

    /// Of a translated program: a frame whose edges have not all been taken.
    struct Light {
        uint64_t begin;  ///< own cycles
        message_t message;
        uint16_t slot;  ///< edges before it have been taken
    };

    /// State of a robot whose EEPROM was written to, that heard others answer a host, or that
    /// printed by the serial line; of a translated one that was shone on.
    struct Rare {
        std::unique_ptr<EepromImage> eeprom;   ///< once it was written to
        std::unique_ptr<gain_tables_t> gains;  ///< found by the program when it started; null:
                                               ///< those of its calibration
        robot_heard_t heard;
        SerialLine serial;                  ///< not of a translated program
        std::unique_ptr<std::string> line;  ///< that it prints, of a translated program
        uint64_t eeprom_free = 0;   ///< of a translated program: when it has written the last byte,
        uint64_t light_asked = 0;   ///< and when it last asked whether a frame has begun
        std::vector<Light> lights;  ///< in order of time
        std::vector<Cycles> told;   ///< when messages beside the medium come, of a translated
                                    ///< program that may miss others
    };

    class Translated;
    static constexpr size_t OFTEN_USED_BYTES = 6 * sizeof(CacheLine);
    static const kt_host_t HOST;
    struct HostCalls;
    static Robot *running;  ///< the one whose program runs; null between runs

    static void body(void *robot);
    void attend_faults();
    void go_on(Cycles until);  ///< executes up to there, or to a question
    void go_on_translated();   ///< the same for one whose program is translated
    /// At rest, of a program that is asked for messages and has none.
    void pass_ticks();
    void live();      ///< on the guest stack: main(), then the main loop
    void set_up();    ///< SETUP: setup(), once
    void run_loop();  ///< loop(), again and again while only ticks happen
    void count_tick(volatile uint32_t &ticks);
    void receive_before_others(Cycles at, const message_t &message,
                               distance_measurement_t distance);
    void inbox_changed() {
        next_message_ = inbox_next_ < inbox_.size() ? inbox_[inbox_next_].at : NEVER;
    }
    Cycles next_interrupt() const { return std::min(next_message_, next_tick_); }
    bool message_comes_next() const { return next_message_ < std::min(next_tick_, until_); }
    /// Up to here only ticks happen.
    Cycles quiet_until() const { return std::min(next_message_, until_); }
    bool ticks_are_ordinary() const { return core_.transmit.increment == TICK_MATCH; }
    /// Whether the timer counts on to an ordinary tick before `until`, and no answer is due.
    bool plain_tick_before(Cycles until) const {
        return next_tick_ < until && ticks_are_ordinary() && !interrupts_off_ &&
               core_.answer.attempts == 0;
    }
    Cycles only_ticks_until(Cycles until) const {
        return plain_tick_before(until) && now_ <= next_tick_ ? until : 0;
    }
    void serve_interrupt();  ///< the one that is due: a message, or a tick
    void tick();             ///< compare match of timer 0
    bool may_send() const { return !arbitrated_ || (granted_from_ <= now_ && now_ <= granted_to_); }
    void ask_for_message(const kt_table_t &table);
    void try_to_answer(const kt_table_t &table);  ///< a question to the runtime
    Cycles next_request() const;                  ///< of the program for a message
    Cycles next_answer() const;
    timer_matches_t next_matches() const;
    /// A frame begins now; without `granted` the channel is asked first. False if that is busy.
    bool put_on_air(const message_t &message, bool granted);
    bool ask_medium(Question question);
    void retry_soon();    ///< back-off: the timer's next match is at a random count
    void take_message();  ///< the first of the inbox: a command, or the program's
    bool receives(const Reception &reception);
    void obey(const message_t &message);
    void start_motion();
    void enter_state(robot_state_t before);
    Cycles main_loop_sees(robot_state_t before) const;  ///< the state that it has got now
    void save_calibration(const message_t &message);
    void gains_saved(uint8_t which, uint8_t *content) const;  ///< as the answer tells them
    void read_gains();                                        ///< as a program that starts does
    void start_again();
    void restart_from_zero(CodePath code);
    /// Calls the program as an interrupt would: interrupts off, a budget of its own.
    template <typename Callback> void interrupt(const kt_table_t &table, Callback callback);
    void wait_until(Cycles wake);
    void suspend();
    void look_at_outputs() {
        look_at_outputs(*program_->table().outputs, program_->table().settle);
    }
    void look_at_outputs(const volatile kt_outputs_t &outputs, void (*settle)());
    /// Notes what has changed of motors and LED, with its time.
    void take_outputs(uint64_t seen);
    void switch_motors(bool on);
    void set_duties(motion_t duties);
    void switch_led_off();
    void came_back();
    void budget_spent(const uint8_t *frame);
    const volatile uint16_t &tx_period(const kt_table_t &table) const;
    bool disturbed() const;
    uint8_t eeprom(uint16_t address) const;
    void set_eeprom(uint16_t address, uint8_t value);
    Rare &written();  ///< made when it is needed for the first time
    void stop(EventKind kind, std::string text, CodePath code = {});
    void report(EventKind kind, std::string text, CodePath code = {});
    void note(uint8_t mistake, std::string text, CodePath code = {});  ///< once each

    // By lines of the cache: the first two are what every run needs ...
    Program *program_ = nullptr;  ///< null: it runs on a board
    uint8_t *image_ = nullptr;    ///< its state while another robot's is in place
    Cycles now_;                  ///< the time run up to
    Cycles until_ = 0;            ///< of the run that goes on
    Cycles tick_length_;          ///< calibration_'s, where every run needs it
    Cycles next_tick_ = NEVER;    ///< compare match of timer 0
    Cycles only_ticks_until_ =
        0;  ///< run_loop() needs not look, or nothing need be executed of a translated program
            ///< (translated_rest.cpp); 0: the program may have changed that
    void (*loop_)(void) = nullptr;

    RobotContext &context_;
    Cycles next_message_ = NEVER;  ///< when the first of its inbox ends
    uint64_t outputs_seen_ = 0;    ///< registers of motors and LED, when last looked at
    BusyWatch busy_;
    uint32_t index_;
    uint32_t last_tick_ =
        0;  ///< kilo_ticks after the last tick, for reports: the program may spoil its own
    uint32_t inbox_next_ = 0;  ///< those before it have been taken
    uint32_t waits_past_tick_ =
        0;  ///< of a callback that waits: so long after next_tick_ it goes on
    robot_core_t core_ = {};
    int16_t stale_conversion_ =
        -1;  ///< of get_voltage(): the next message's high gain is read from its channel
    Life life_ : 2 = Life::OFF;
    Question question_ : 2 = Question::NONE;
    bool is_suspended_ : 1 = false;    ///< a call waits in suspended_, which only then is looked at
    bool arbitrated_ : 1 = false;      ///< the channel decides, by answer()
    bool in_interrupt_ : 1 = false;    ///< in a callback of the program
    bool interrupts_off_ : 1 = false;  ///< by cli()
    bool loop_due_ : 1 = false;        ///< a tick has passed since loop() came back
    bool answer_ : 1 = false;          ///< of the channel
    bool tick_pending_ : 1 = false;    ///< a tick came while interrupts were off
    bool has_no_message_ : 1 = false;  ///< of a translated program, up to only_ticks_until_

    // ... the next two what comes in and goes out ...
    Few<Reception, 2> inbox_;  ///< in order of time, from inbox_next_ on

  public:
    /// Motor commands of the last run(), in order of time; the caller clears them.
    Few<MotorCommand, 2> motor_commands;

  private:
    // ... then what blocking calls, sending and receiving by the Kilobot's medium, and other
    // outputs need ...
    SuspendedCall suspended_;  ///< the program in a delay(), or between runs
    Cycles granted_from_ = NEVER, granted_to_ = 0, granted_until_ = 0;
    message_t outgoing_;                   ///< of the attempt
    uint16_t period_ = TX_PERIOD_DEFAULT;  ///< kilo_tx_period of a program that settles it

  public:
    /// Reading of the light sensor from now on, 0..1023; set from outside.
    int16_t light = 0;

  private:
    Few<std::pair<Cycles, Cycles>, 1> frames_seen_;  ///< light on the receiver: begin, end
    Cycles driven_ = 0;                              ///< with a motor on, up to driving_since_
    Cycles driving_since_ = NEVER;
    uint32_t rand_hard_draws_ = 0;  ///< so far
    uint8_t left_ = 0, right_ = 0;  ///< duties
    uint8_t color_ = 0;             ///< of the LED, as the program set it
    uint8_t noted_ = 0;             ///< Mistakes

    // ... and what changes rarely.
    std::unique_ptr<Rare> rare_;  ///< by written()
    Cycles overflow_ = NEVER;     ///< after a retry: when the timer's next ordinary match comes
    Cycles state_since_;          ///< for the light of states
    Cycles acts_at_ = 0;          ///< when the main loop sees the state; of SLEEPING: when it last
                                  ///< went down (sleep_rhythm.h)
    Cycles power_up_;
    void (*setup_)(void) = nullptr;
    const std::string *name_;  ///< of its program
    Calibration calibration_;
};

/// Looks at what the registers now make of motors and LED; `settle` is the table's, or null.
inline void Robot::look_at_outputs(const volatile kt_outputs_t &outputs, void (*settle)()) {
    if (settle != nullptr) [[unlikely]]
        settle();
    uint64_t seen;
    static_assert(sizeof seen == sizeof outputs);
    std::memcpy(&seen, const_cast<const kt_outputs_t *>(&outputs), sizeof seen);
    if (seen != outputs_seen_) [[unlikely]]
        take_outputs(seen);
}

}  // namespace kilotwin

#endif
