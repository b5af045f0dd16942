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
/// time: translated/robot.h.
///
/// Sources: robot.cpp (running: ticks, interrupts, loop()), robot_inputs.cpp (what reaches it),
/// native/calls.cpp (what its program calls), robot_outputs.cpp (what it shows); native programs.
#ifndef KILOTWIN_ROBOTS_ROBOT_H
#define KILOTWIN_ROBOTS_ROBOT_H

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/few.h"
#include "base/memory.h"
#include "base/prefetch.h"
#include "robots/record.h"
#include "robots/timer.h"

namespace kilotwin {

/// One per robot, on a board or not. The channel executes those with a program.
class alignas(64) Robot : private RobotRecord {
  public:
    using RobotRecord::light;
    using RobotRecord::motor_commands;
    using RobotRecord::Question;

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

    /// Prefetch the fields of receive(), and those of disturb() as well.
    void prefetch_receiver() const {
        prefetch_line(&next_message_);
        prefetch_line(&inbox_);
        prefetch_line(&inbox_ + 1);  // it ends on another line
    }
    void prefetch_light() const {
        prefetch_receiver();
        prefetch_line(this);
        prefetch_line(&frames_seen_);
    }

    /// Runs the robot through everything strictly before `until`. Every attempt to send succeeds.
    void run(Cycles until);

    /// The same, but it stops where the program is about to be requested for a message, or sends
    /// one: then the channel decides by answer(). Returns the time run up to: `until`, or that of
    /// the question.
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

    /// Whether its program can tell that light falls on its receiver; a board sees for itself.
    bool heeds_light() const { return !on_board() && program_->reads_sensors(); }

    /// A frame is being received from `begin` to `end`: meanwhile sensors return -1, and the edges
    /// of its light take time from a translated program. Only if heeds_light().
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

    // Tentative runs, of a native program only.

    /// A robot at a moment, with its program's variables.
    class Saved {
      public:
        explicit Saved(const Robot &robot) : record_(robot), variables_(robot.state()) {}

      private:
        friend Robot;
        RobotRecord record_;
        std::vector<uint8_t> variables_;
    };
    /// Copies the robot into `saved`, which was made of a robot with the same program. Costs a copy
    /// of 512 bytes and of its program's variables, and of what it has allocated: its inbox, and
    /// the stack of a program that waits.
    void save(Saved &saved) const;

    /// Whether it has had no message the last times that its program was asked for one. Never so of
    /// a translated program.
    bool is_quiet() const { return nulls_ >= NULLS_TO_BE_QUIET; }

    /// Runs it as run_arbitrated() does, but as if no light reached it before `until`: MAY_ASK is
    /// answered with yes. `saved` is the robot as it is now. Returns whether bring_back() can undo
    /// that. If not, it is undone already: it told something (an event), or set the floating-point
    /// units otherwise.
    bool run_tentatively(Cycles until, const Saved &saved);

    /// Brings it back to where it was saved, and once more up to `until`, as far as no light
    /// reaches it. Its motor commands up to there are those that it gave the first time; they do
    /// not come again.
    void bring_back(const Saved &saved, Cycles until);
    /// Goes on from there: runs it as run_tentatively() does, and answers for nothing.
    void run_in_the_dark(Cycles until);

    /// When the first message of its inbox ends; NEVER without one.
    Cycles next_message() const { return next_message_; }

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
    class Translated;
    static constexpr int NULLS_TO_BE_QUIET = 4;
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
    bool may_be_asked();  ///< its program, for a message
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
    /// Brings it back, resident or not. Events that it told and light that it saw stay.
    void restore(const Saved &saved);
    void stop(EventKind kind, std::string text, CodePath code = {});
    void report(EventKind kind, std::string text, CodePath code = {});
    void note(uint8_t mistake, std::string text, CodePath code = {});  ///< once each
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
