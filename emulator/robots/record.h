/// All that changes of a robot while it runs, but for its program's variables: a copy is the robot
/// at a moment, to which it can be brought back (robot.h).
#ifndef KILOTWIN_ROBOTS_RECORD_H
#define KILOTWIN_ROBOTS_RECORD_H

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
#include "robots/native/busy_watch.h"
#include "robots/native/program.h"
#include "robots/native/serial_line.h"
#include "robots/native/stack.h"

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

/// Which robot runs, for the report if its program kills the process, and for the watch that does
/// if it does not come back. Survives that when it is a mapped file.
struct BlackBox {
    uint32_t robot;    ///< index of the last that ran
    uint32_t tick;     ///< its kilo_ticks at the last tick
    uint64_t steps;    ///< world steps so far
    uint32_t at_work;  ///< 0: the engine is between two calls, and no robot runs

    void runs(uint32_t index, uint32_t its_tick) {
        robot = index;
        tick = its_tick;
    }
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

class RobotRecord {
  public:
    /// Answers of the channel that a robot may wait for: whether its program is to be asked for a
    /// message, or whether the one that it wants to send finds the channel free.
    enum class Question : uint8_t { NONE, MAY_ASK, IS_CHANNEL_FREE };

  protected:
    /// STOPPED: its program crashed or never came back; it stays where it is.
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };

    /// A frame whose edges a translated program has not all taken.
    struct Light {
        uint64_t begin;  ///< own cycles
        message_t message;
        uint16_t slot;  ///< edges before it have been taken
    };

    /// State of a robot whose EEPROM was written to, that heard others answer a host, or that
    /// printed by the serial line; of a translated one that was shone on.
    struct Rare {
        Own<EepromImage> eeprom;   ///< once it was written to
        Own<gain_tables_t> gains;  ///< found by the program when it started; null: those of its
                                   ///< calibration
        robot_heard_t heard;
        SerialLine serial;          ///< not of a translated program
        Own<std::string> line;      ///< that it prints, of a translated program
        uint64_t eeprom_free = 0;   ///< of a translated program: when it has written the last byte,
        uint64_t light_asked = 0;   ///< and when it last asked whether a frame has begun
        std::vector<Light> lights;  ///< in order of time
        std::vector<Cycles> told;   ///< when messages beside the medium come, of a translated
                                    ///< program that may miss others
    };

    RobotRecord(RobotContext &context, Program *program, uint8_t *image, uint32_t index,
                const std::string &name, const Calibration &calibration, Cycles power_up)
        : program_(program),
          image_(image),
          now_(power_up),
          tick_length_(calibration.tick),
          context_(&context),
          index_(index),
          outgoing_(),
          state_since_(power_up),
          power_up_(power_up),
          name_(&name),
          calibration_(calibration) {}

    // By lines of the cache: the first two are what every run needs ...
    Program *program_ = nullptr;  ///< null: it runs on a board
    uint8_t *image_ = nullptr;    ///< its state while another robot's is in place
    Cycles now_;                  ///< the time run up to
    Cycles until_ = 0;            ///< of the run that goes on
    Cycles tick_length_;          ///< calibration_'s, where every run needs it
    Cycles next_tick_ = NEVER;    ///< compare match of timer 0
    /// Until then only ticks pass: run_loop() can skip its checks, and a translated program
    /// executes nothing (translated/rest.cpp). 0 when the program may have changed that.
    Cycles only_ticks_until_ = 0;
    void (*loop_)(void) = nullptr;

    RobotContext *context_;
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
    bool is_suspended_ : 1 = false;  ///< a call waits in suspended_, which only then is looked at
    bool arbitrated_ : 1 = false;    ///< the channel decides, by answer()
    bool in_interrupt_ : 1 = false;  ///< in a callback of the program; translated: in an interrupt
    bool interrupts_off_ : 1 = false;  ///< by cli()
    bool loop_due_ : 1 = false;        ///< a tick has passed since loop() came back
    bool answer_ : 1 = false;          ///< of the channel
    bool tick_pending_ : 1 = false;    ///< a tick came while interrupts were off
    bool has_no_message_ : 1 = false;  ///< of a translated program, up to only_ticks_until_
    bool in_the_dark_ : 1 = false;     ///< no frame is being received: its program may be asked
    uint8_t nulls_ : 3 = 0;  ///< so many times running it had no message when asked, up to some

    // ... the next two what comes in and goes out ...
    Few<Reception, 2> inbox_;  ///< in order of time, from inbox_next_ on

  public:
    /// Motor commands of the last run(), in order of time; the caller clears them.
    Few<MotorCommand, 2> motor_commands;

  protected:
    // ... then what blocking calls, sending and receiving by the Kilobot's medium, and other
    // outputs need ...
    SuspendedCall suspended_;  ///< the program in a delay(), or between runs
    Cycles granted_from_ = NEVER, granted_to_ = 0, granted_until_ = 0;
    message_t outgoing_;                   ///< of the attempt
    uint16_t period_ = TX_PERIOD_DEFAULT;  ///< kilo_tx_period of a program that settles it

  public:
    /// Reading of the light sensor from now on, 0..1023; set from outside.
    int16_t light = 0;

  protected:
    Few<std::pair<Cycles, Cycles>, 1> frames_seen_;  ///< light on the receiver: begin, end
    Cycles driven_ = 0;                              ///< with a motor on, up to driving_since_
    Cycles driving_since_ = NEVER;
    uint32_t rand_hard_draws_ = 0;  ///< so far
    uint8_t left_ = 0, right_ = 0;  ///< duties
    uint8_t color_ = 0;             ///< of the LED, as the program set it
    uint8_t noted_ = 0;             ///< Mistakes

    // ... and what changes rarely.
    Own<Rare> rare_;           ///< by written()
    Cycles overflow_ = NEVER;  ///< after a retry: when the timer's next ordinary match comes
    Cycles state_since_;       ///< for the light of states
    Cycles acts_at_ = 0;       ///< when the main loop sees the state; of SLEEPING: when it last
                               ///< went down (sleep_rhythm.h)
    Cycles power_up_;
    void (*setup_)(void) = nullptr;
    const std::string *name_;  ///< of its program
    Calibration calibration_;
};

}  // namespace kilotwin

#endif
