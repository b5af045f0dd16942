/// A robot of a run, as channels, boards and the simulation see it: its record, and the driver of
/// its group, which executes its program.
#ifndef KILOTWIN_ROBOTS_ROBOT_H
#define KILOTWIN_ROBOTS_ROBOT_H

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/board_clock.h"
#include "base/clock.h"
#include "base/few.h"
#include "base/memory.h"
#include "base/prefetch.h"
#include "robots/driver.h"
#include "robots/record.h"

namespace kilotwin {

/// One per robot, which stays where it is made: its driver refers to it.
class alignas(64) Robot {
  public:
    using Question = RobotRecord::Question;

    /// Robot `index`, of the driver's group, switched on at `power_up`.
    Robot(RobotContext &context, Driver &driver, uint32_t index, const Calibration &calibration,
          Cycles power_up);
    ~Robot() { driver().switch_off(record_); }
    Robot(Robot &&) = default;
    Robot(const Robot &) = delete;
    Robot &operator=(const Robot &) = delete;

    /// Brings the robot, then its state and inbox, into the cache before a run.
    void prefetch() const { prefetch_bytes(this, OFTEN_USED_BYTES); }
    void prefetch_state() const {
        prefetch_line(record_.inbox.data());
        prefetch_bytes(record_.own, driver().own_bytes());
    }

    /// Prefetches what next_ask() looks at besides the record, which is in the cache by now.
    void prefetch_ask() const { prefetch_bytes(record_.own, 2 * sizeof(CacheLine)); }

    /// Prefetches the record's first line: that of is_mute() and is_deaf().
    void prefetch_life() const { prefetch_line(this); }

    /// Prefetch the fields of receive(), and those of disturb() as well.
    void prefetch_receiver() const {
        prefetch_line(&record_.next_message);
        prefetch_line(&record_.inbox);  // it fills a line
    }
    void prefetch_light() const {
        prefetch_receiver();
        prefetch_line(&record_.frames_seen);
    }

    /// Its kilo_ticks go on by so many, as if it had been on for longer.
    void count_on(uint32_t ticks) {
        if (ticks > 0) driver().count_on(record_, ticks);
    }

    /// Runs the robot through everything strictly before `until`. Every attempt to send succeeds.
    void run(Cycles until);

    /// The same, but it stops where the program is about to be requested for a message, or sends
    /// one: then the channel decides by answer(). Returns the time run up to: `until`, or that of
    /// the question.
    Cycles run_arbitrated(Cycles until);
    Question question() const { return record_.question; }  ///< the one that waits for answer()
    Cycles now() const { return record_.now; }              ///< the time run up to

    /// Answers both questions with yes beforehand, should they come up from `first` to `last` in
    /// the next run. The frame is appended to the context's emissions, and the robot runs on until
    /// `until`: nothing reaches a robot that sends.
    void grant(Cycles first, Cycles last, Cycles until) {
        record_.granted_from = first;
        record_.granted_to = last;
        record_.granted_until = until;
    }

    /// Answers MAY_ASK (no: a frame is being received; the next attempt is at the next tick) or
    /// IS_CHANNEL_FREE (no: the attempt failed; it backs off). The next run goes on from there.
    void answer(bool yes) {
        record_.answer = yes;
        record_.question = Question::NONE;
    }

    /// After IS_CHANNEL_FREE: the message of the attempt.
    const message_t &outgoing() const { return record_.outgoing; }

    /// Lookahead: the earliest moment at which the program may be requested for a message, or its
    /// runtime answers a question; NEVER if only a command changes that. Constant time.
    Cycles next_ask() const { return driver().next_ask(record_); }

    /// Puts a message whose frame ends at `at`, not earlier than the time run up to, into the
    /// inbox. Any order; cheapest in order of time.
    void receive(Cycles at, const message_t &message, distance_measurement_t distance) {
        record_.receive(at, message, distance);
    }

    /// The same of a message that is no light, but comes beside the medium: it is never missed,
    /// also if others come at the same time.
    void receive_beside(Cycles at, const message_t &message, Trail::Kind from) {
        if (record_.context->trail != nullptr) [[unlikely]]
            record_.context->trail->arrived({from, 0}, {Trail::Kind::ROBOT, index()}, at, at,
                                            message);
        record_.receive(at, message, {});
        driver().received_beside(record_, at);
    }

    /// Whether disturb() is to be called.
    bool heeds_light() const { return driver().heeds_light(); }

    /// A frame is being received from `begin` to `end`: meanwhile sensors return -1, and the edges
    /// of its light take time from a translated program.
    void disturb(Cycles begin, Cycles end, const message_t &message) {
        driver().disturb(record_, begin, message);
        record_.see_frame(begin, end);
    }

    // For a board: takes the inbox out, in order of time; notes what the board's pins do, and a
    // crash.
    Few<Reception, 2> take_inbox() {
        record_.next_message = NEVER;
        return std::exchange(record_.inbox, {});
    }
    void drive(const MotorCommand &command) { record_.drive(command); }
    void show(uint8_t color, Cycles at) { record_.show(color, at); }
    void report(Cycles at, uint32_t tick, EventKind kind, std::string text);
    void crash(Cycles at, uint32_t tick, std::string text, CodePath code);

    // Failures that an experiment asks for, between two steps. Each is an event.
    void die(Cycles at, uint32_t tick);     ///< it stops for good, LED and motors off
    void deafen(Cycles at, uint32_t tick);  ///< no message reaches it any more
    void mute(Cycles at, uint32_t tick);    ///< none of its own reaches anybody
    void receive_again(Cycles at, uint32_t tick);
    void transmit_again(Cycles at, uint32_t tick);
    void report_fault(Cycles at, uint32_t tick, const char *what);  ///< of its motors
    uint32_t last_tick() const { return record_.last_tick; }        ///< kilo_ticks, but of a board
    bool is_deaf() const { return record_.is_deaf; }
    bool is_mute() const { return record_.is_mute; }

    /// Converter reading of its battery, 0..1023.
    int16_t voltage(Cycles at) const { return record_.voltage(at); }
    /// Sets the readings of all sensors as they are at `at`.
    void read_sensors(Cycles at, Readings &readings) const {
        for (const Sensor &sensor : SENSORS)
            readings[sensor.channel] = reading_of(record_, sensor.channel, at);
    }
    /// Sets the reading of its light sensor from now on, 0..1023.
    void set_light(int16_t reading) { record_.light = reading; }

    /// Frames that it sent in the last run, if it ran last of its share.
    std::vector<Emission> &emissions() { return record_.context->emissions; }
    /// The share of the robots that it belongs to (base/team.h).
    uint32_t share() const { return record_.context->share; }

    /// Motor commands of the last run, in order of time; the caller clears them.
    Few<MotorCommand, 2> &motor_commands() { return record_.motor_commands; }

    // Tentative runs, of robots that can_restore().

    bool can_restore() const { return driver().can_restore(); }

    /// A robot at a moment, with its program's variables.
    class Saved {
      public:
        explicit Saved(const Robot &robot)
            : record_(robot.record_),
              own_(robot.driver().make_kept()) {
            robot.save(*this);
        }

      private:
        friend Robot;
        RobotRecord record_;
        std::unique_ptr<Driver::Kept> own_;
    };
    /// Copies the robot into `saved`, which was made of a robot of the same driver. Costs a copy of
    /// its record, of its driver's state of it and of its program's variables, and of what it has
    /// allocated: its inbox, and the stack of a program that waits.
    void save(Saved &saved) const;

    /// Whether it has had no message the last times that its program was requested for one. Never
    /// so of a translated program.
    bool is_quiet() const { return record_.nulls >= RobotRecord::QUIET; }

    /// Runs it as run_arbitrated() does, but as if no light reached it before `until`: MAY_ASK is
    /// answered with yes. `saved` is the robot as it is now. Returns whether bring_back() can undo
    /// that. If not, it is undone already: it reported an event, or set the floating-point units
    /// otherwise.
    bool run_tentatively(Cycles until, const Saved &saved);

    /// Brings it back to where it was saved, and once more up to `until`, as far as no light
    /// reaches it. Its motor commands up to there are those that it gave the first time; they do
    /// not come again.
    void bring_back(const Saved &saved, Cycles until);
    /// Goes on from there: runs it as run_tentatively() does, and answers for nothing.
    void run_in_the_dark(Cycles until);

    /// When the first message of its inbox ends; NEVER without one.
    Cycles next_message() const { return record_.next_message; }

    // Identity and state, for reading at any time.
    uint32_t index() const { return record_.index; }  ///< in the experiment
    uint16_t uid() const { return record_.calibration.uid; }
    /// RGB() value shown at `at`, the time run up to.
    uint8_t color(Cycles at) const { return driver().color(record_, at); }
    bool stopped() const { return record_.life == RobotRecord::Life::STOPPED; }  ///< it failed
    const Calibration &calibration() const { return record_.calibration; }
    const Driver &driver() const { return *record_.driver; }

    /// Messages that its program has got so far, of those received; NOT_KNOWN of one on a board.
    static constexpr uint32_t NOT_KNOWN = UINT32_MAX;
    uint32_t delivered() const {
        const Tier tier = driver().tier();
        return tier == Tier::CHIP || tier == Tier::INTERPRETED ? NOT_KNOWN : record_.delivered;
    }

    /// Copy of its program's variables; empty for a robot on a board.
    std::vector<uint8_t> variables() const { return driver().variables(record_); }

    // For a debugger (driver.h).
    BoardClock clock() const { return {record_.power_up, record_.tick_length}; }
    Driver::Standing standing() const { return driver().standing(record_); }
    void begin_hold() { driver().begin_hold(record_); }

    /// Duties of its motors as they are driven now, 0..255.
    uint8_t left_duty() const { return record_.left; }
    uint8_t right_duty() const { return record_.right; }
    /// Times so far that its LED or motors changed; changes within a tick are one.
    uint32_t decisions() const { return record_.decisions; }

  private:
    static constexpr size_t OFTEN_USED_BYTES = 5 * sizeof(CacheLine);

    Driver &driver() { return *record_.driver; }
    void go_on(Cycles until);  ///< executes up to there, or to a question
    void restore(const Saved &saved);

    RobotRecord record_;
};

}  // namespace kilotwin

#endif
