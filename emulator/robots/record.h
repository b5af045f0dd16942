/// The record of a robot: what all robots have, however their programs are executed. What a driver
/// needs besides is its own (driver.h). A copy is the robot at a moment, to which it can be brought
/// back.
#ifndef KILOTWIN_ROBOTS_RECORD_H
#define KILOTWIN_ROBOTS_RECORD_H

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/chance.h"
#include "base/clock.h"
#include "base/events.h"
#include "base/few.h"
#include "base/memory.h"
#include "base/motor_command.h"
#include "kilolib/core/robot_commands.h"
#include "robots/eeprom.h"
#include "robots/infrared_gains.h"
#include "robots/sensors.h"
#include "robots/timer.h"
#include "robots/trail.h"

namespace kilotwin {

class Driver;

/// A frame that a robot receives; delivered when it ends.
struct Reception {
    Cycles at;  ///< end of the frame
    message_t message;
    distance_measurement_t distance;
};

/// A frame that a robot sends.
struct Emission {
    Cycles at;       ///< begin of the frame
    uint32_t robot;  ///< index; in lists of a channel, its slot
    message_t message;
};

/// A message that a program got.
struct Heard {
    Cycles at;  ///< end of its frame
    uint32_t robot;
    uint8_t distance_mm;
    message_t message;
};

/// Some robots whose programs' messages are written down, if they run natively: each share of the
/// robots writes its own. A robot that is brought back gets some of them twice.
struct Listening {
    std::vector<uint32_t> robots;
    std::vector<Heard> heard = {};
};

/// Which robots run, for the report if the program of one kills the process, and for the watch that
/// does if it does not come back. Survives that when it is a mapped file.
struct BlackBox {
    static constexpr uint32_t MOST_SHARES = 32, NONE = UINT32_MAX;

    /// The place of a share of the robots (base/team.h), which one thread runs at a time.
    struct alignas(64) Share {
        uint32_t robot;  ///< index of the last that ran; NONE: of several shares, this one is done
        uint32_t tick;   ///< its kilo_ticks at the last tick

        void runs(uint32_t index, uint32_t its_tick) {
            robot = index;
            tick = its_tick;
        }
    };

    uint64_t steps;    ///< world steps so far
    uint32_t at_work;  ///< 0: the engine is between two calls, and no robot runs
    uint32_t shares;   ///< how many there are, MOST_SHARES at most
    Share share[MOST_SHARES];
};

class Debugging;
class WrittenBytes;

/// Shared by all robots of a share (base/team.h); `events`, `emissions` and what their programs
/// learn are the share's own.
struct RobotContext {
    const Chance &chance;
    Events &events;
    std::vector<Emission> &emissions;      ///< of granted attempts; each robot's in order of time
    BlackBox::Share *black_box = nullptr;  ///< may be null
    Cycles frame = 0;                      ///< how long sending keeps a robot busy; 0 with `ideal`
    bool gains_are_mm = true;  ///< the medium reports the distance itself, as both gains
    Cycles battery = 0;        ///< how long it drives on a full battery; 0: for ever
    Readings readings = usual_readings();  ///< of sensors that read the same for all robots
    bool recalls_passes = true;            ///< of translated programs, those that change nothing
    Listening *listening = nullptr;        ///< null: to none
    Trail *trail = nullptr;                ///< of what their code does; null: none is kept
    Debugging *debugging = nullptr;        ///< of translated programs; null: none is held
    WrittenBytes *written = nullptr;       ///< likewise: what one of them writes; null: none
    uint32_t share = 0;                    ///< of the robots, whose context this is (base/team.h)
};

/// Faults that are noted once per robot, as bits: mistakes that its program survives, and an order
/// that cannot be obeyed here.
enum Mistakes : uint8_t {
    DIVIDES_BY_ZERO = 1,
    LOST_POINTER = 2,      ///< an address in the robot's RAM that this program does not have
    BEYOND_VARIABLES = 4,  ///< an address just outside its variables
    JUMPS_TO_ZERO = 8,     ///< a restart, as `jmp 0` does
    HAS_NO_LOADER = 16,    ///< BOOT came, to a program that has no flash
    LEAVES_PROGRAM = 32,   ///< to flash without code, which leads to address 0
    STACK_MEETS_DATA = 64,
};

struct RobotRecord : GuestTime {
    /// Questions to the channel that a robot may wait for: whether its program is to be requested
    /// for a message, or whether the one that it wants to send finds the channel free.
    enum class Question : uint8_t { NONE, MAY_ASK, IS_CHANNEL_FREE };
    /// STOPPED: its program crashed or never came back, or it died; it stays where it is.
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };

    RobotRecord(RobotContext &of_all, Driver &of_group, uint32_t number,
                const Calibration &calibrated, Cycles switched_on)
        : GuestTime{.now = switched_on, .tick_length = calibrated.tick},
          driver(&of_group),
          index(number),
          context(&of_all),
          outgoing(),
          power_up(switched_on),
          calibration(calibrated) {}

    // By lines of the cache, with GuestTime first: those that every run needs, of which a frame
    // that is received needs the first ...
    Driver *driver;
    Cycles next_message = NEVER;  ///< when the first of its inbox ends
    /// Until then only ticks pass: nothing else of its program need be looked at, and a translated
    /// one executes nothing (translated/rest.cpp). 0 when the program may have changed that.
    Cycles only_ticks_until = 0;
    uint32_t index;  ///< in the experiment (base/slots.h)
    Life life : 2 = Life::OFF;
    Question question : 2 = Question::NONE;
    bool arbitrated : 1 = false;   ///< the channel decides, by answer
    bool answer : 1 = false;       ///< of the channel
    bool in_the_dark : 1 = false;  ///< no frame is being received: its program may be requested
    /// Up to only_ticks_until its program, whenever it is requested for a message, has none.
    bool has_no_message : 1 = false;
    bool may_ask_now : 1 = false;  ///< next_ask() is the time run up to: an interrupt is not over
    /// Though a tick's waits it lets no interrupt through before waits_past_tick is over.
    bool holds_interrupts : 1 = false;
    bool is_deaf : 1 = false;  ///< its receiver has failed: its inbox stays empty
    bool is_mute : 1 = false;  ///< its infrared LED has failed: nobody sees what it sends
    /// So many times running its program had no message when requested, up to QUIET.
    uint8_t nulls : 3 = 0;
    uint8_t noted = 0;  ///< Mistakes
    uint8_t color = 0;  ///< of the LED, as the program set it

    void *own = nullptr;  ///< its driver's state of it
    RobotContext *context;
    uint64_t outputs_seen = 0;  ///< registers of motors and LED, when last looked at
    /// kilo_ticks after the last tick, for reports: the program may spoil its own.
    uint32_t last_tick = 0;
    uint32_t inbox_next = 0;       ///< those before it have been taken
    uint32_t waits_past_tick = 0;  ///< of a callback that waits: so long after next_tick it goes on
    robot_core_t core = {};
    Cycles granted_from = NEVER, granted_to = 0;

    // ... the next two what comes in and goes out ...
    Few<Reception, 2> inbox;  ///< in order of time, from inbox_next on
    /// Motor commands of the last run, in order of time; the caller clears them.
    Few<MotorCommand, 2> motor_commands;

    // ... then what sending and receiving by the Kilobot's medium, and other outputs need ...
    Cycles granted_until = 0;
    message_t outgoing;  ///< of the attempt
    /// Reading of the light sensor from now on, 0..1023; set from outside.
    int16_t light = 0;
    uint8_t left = 0, right = 0;                    ///< duties
    Few<std::pair<Cycles, Cycles>, 1> frames_seen;  ///< light on the receiver: begin, end
    Cycles driven = 0;                              ///< with a motor on, up to driving_since
    Cycles driving_since = NEVER;
    uint32_t delivered = 0;  ///< messages that its program has got
    uint32_t decisions = 0;  ///< times that LED or motors changed, a tick apart at least
    Cycles last_decision = 0;
    uint32_t rand_hard_draws = 0;  ///< so far

    // ... and what changes rarely.
    Cycles overflow = NEVER;  ///< after a retry: when the timer's next ordinary match comes
    Cycles power_up;
    Own<EepromImage> eeprom_image;  ///< once it was written to
    Calibration calibration;

    static constexpr int QUIET = 4;

    // Time and the channel (record.cpp).

    void inbox_changed() {
        next_message = inbox_next < inbox.size() ? inbox[inbox_next].at : NEVER;
    }
    void forget_taken();  ///< those of its inbox
    void empty_inbox();
    Cycles next_interrupt() const { return std::min(next_message, next_tick); }
    bool ticks_are_ordinary() const { return core.transmit.increment == TICK_MATCH; }
    timer_matches_t next_matches() const {
        return {next_tick, ticks_are_ordinary() ? next_tick + tick_length : overflow};
    }
    Cycles next_answer() const;  ///< of its runtime, to a question
    /// When its transmit clock is next due, if the program has `period`; it runs or is set up.
    Cycles next_request(uint16_t period) const {
        return transmit_clock_next_request(&core.transmit, period, next_matches(), tick_length);
    }
    bool may_send() const { return !arbitrated || (granted_from <= now && now <= granted_to); }
    /// A frame that no other can disturb begins now.
    void emit(const message_t &message);

    // Inputs.

    void receive(Cycles at, const message_t &message, distance_measurement_t distance) {
        // Most come in order, and after the first one nothing else of the robot has to be looked
        // at.
        if (inbox.empty()) {
            if (life == Life::STOPPED || is_deaf) return;
            next_message = at;
        } else if (at < inbox.back().at) {
            return receive_before_others(at, message, distance);
        }
        Reception &last = inbox.emplace_back();  // filled where it stands, as frames are
        last.at = at;
        last.message = message;
        last.distance = distance;
    }
    void receive_before_others(Cycles at, const message_t &message,
                               distance_measurement_t distance);
    void see_frame(Cycles begin, Cycles end);  ///< light on its receiver
    bool disturbed() const;                    ///< by such light, now
    uint8_t eeprom(uint16_t address) const;
    void set_eeprom(uint16_t address, uint8_t value);

    // Outputs.

    /// Converter reading of its battery, 0..1023.
    int16_t voltage(Cycles at) const;
    void drive(const MotorCommand &command);
    void show(uint8_t rgb, Cycles at);  ///< by the LED
    void decide(Cycles at);             ///< counts it
    void report(EventKind kind, std::string text, CodePath code = {});
    void note(uint8_t mistake, std::string text, CodePath code = {});  ///< once each
    /// Its program failed. Its driver frees what only a running program needs.
    void stop(EventKind kind, std::string text, CodePath code = {});
    void deafen();  ///< its receiver fails now
    void die();     ///< it stops for good, with its LED off
};

}  // namespace kilotwin

#endif
