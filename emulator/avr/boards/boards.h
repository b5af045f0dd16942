/// The robots and modules of a world that run on boards: executed in lock-step, coupled by light.
///
/// All boards are executed up to the same moment, then for the next QUANTUM cycles. What one of
/// them sends reaches others, boards or not, a QUANTUM later; what others send reaches a board
/// without delay. Messages from outside the channel (overhead controller, virtual floor) come as
/// light, too, while nothing else is on air around the robot, and again if other light comes
/// between.
///
/// To the channel a board is a sender whose message is known only when it has ended: it gets
/// flashes, and what a reader of pulses makes of them. Stations are the robots, then four cells for
/// each module. What a module's controller queues reaches its bus a QUANTUM later; it has one frame
/// there at a time, and waits with it while its node may not send. One thread executes all boards
/// of a world.
#ifndef KILOTWIN_AVR_BOARDS_BOARDS_H
#define KILOTWIN_AVR_BOARDS_BOARDS_H

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "avr/boards/module_board.h"
#include "avr/boards/robot_board.h"
#include "base/memory.h"
#include "grid/cells.h"
#include "infrared/infrared_pulses.h"
#include "modules/driver.h"
#include "robots/robot.h"

namespace kilotwin {

/// One per run; empty without chips. The channel executes it (board_stations.h).
class Boards final : public ModuleDriver {
  public:
    /// The lock-step and the lag of light: 128 us, a count of a robot's timer 0.
    static constexpr Cycles QUANTUM = 1024;

    /// Light of a board's IR LED, when it reaches others.
    struct Flash {
        Cycles at, end;            ///< the LED is on from, and to before
        uint32_t station;          ///< the robot, or the cell
        bool begins;               ///< false: the LED has been on before
        bool given_up = false;     ///< no light at all: what the station began is over
        PulseReader::Found found;  ///< what this pulse is in the station's frame
        message_t message;         ///< with Found::MESSAGE
    };

    /// `robots` are those of the world; they must live on and not move in memory. `context`, too.
    Boards(Swarm<Robot> &robots, const RobotContext &context);

    /// The program of all modules: an image of the chip, or EngineError.
    void load_module(const std::string &program) { module_flash_ = FlashImage::load(program); }

    /// Gives robot `index`, which was made without a program, a board. In ascending order of index.
    void add(uint32_t index, const FlashImage &flash, Cycles power_up);

    /// Whether nothing runs on a board.
    bool empty() const { return places_.empty() && modules_.empty(); }
    bool has_modules() const { return !modules_.empty(); }
    Cycles now() const { return now_; }  ///< all have been executed up to here
    /// Whether a robot runs on a board, and the robots that do, ascending.
    bool has(uint32_t robot) const { return robot < place_of_.size() && place_of_[robot] >= 0; }
    const std::vector<uint32_t> &robots() const { return robots_with_; }
    /// The board of a robot that has() one.
    RobotBoard &board(uint32_t robot) { return up_to_date(place(robot)); }

    /// The same for any robot: EngineError if it does not exist, or has no board.
    RobotBoard &board_of(size_t robot);

    /// A robot that has() one dies: its light goes off, and its chip does nothing more.
    void switch_off(uint32_t robot);

    const RobotBoard &board(uint32_t robot) const {
        return const_cast<Boards *>(this)->place(robot).board;
    }

    // The modules.
    void add(uint8_t x, uint8_t y, Cycles tick, Cycles power_up) override;
    void set_power(uint32_t index, Cycles at, bool on) override;
    /// None: an MCP2515 filters by itself.
    std::vector<uint16_t> filters(uint32_t /*module*/) const override { return {}; }
    void receive_can(uint32_t module, Cycles at, const CanFrame &frame,
                     const CanErrors &errors) override;
    void frame_sent(uint32_t module, Cycles at) override;
    void pass_frames(ModuleNodes &nodes) override;
    CellLight light(uint32_t module, uint8_t cell, Cycles at) override;
    About about(uint32_t module) override;
    Events take_events() override { return std::exchange(module_events_, {}); }
    /// The cell that the multiplexer of its receiver selects.
    uint8_t listening_cell(uint32_t module) const {
        return modules_[module].board->listening_cell();
    }

    /// Executes all boards up to `until`, quantum by quantum, or returns the next flash before
    /// `until`, which the caller passes on before it goes on. busy(robot) says whether anything is
    /// on air around a robot.
    template <typename Busy> std::optional<Flash> run(Cycles until, Busy busy) {
        take_messages();
        while (true) {
            const Cycles next = now_ + QUANTUM;
            if (!flashes_.empty() && flashes_.front().at < std::min(next, until))
                return take_flash();
            if (next > until) return std::nullopt;
            if (rest(until)) continue;
            for (Place *told : told_) {
                Place &place = *told;
                end_message(place);
                if (place.messages.empty() || place.shows) continue;
                // A receiver that was disturbed is itself again after a silence.
                if (busy(place.index)) place.light_free = next + QUANTUM + PulseReader::SILENCE;
                if (place.message_due() <= next) shine_message(place, next);
            }
            std::erase_if(told_, [](const Place *place) { return place->messages.empty(); });
            execute(next);
        }
    }

    /// A frame begins at a station: forgets which boards its light reached before.
    void forget_reached(uint32_t station);

    /// The light of `station` reaches a robot or a cell that has a board, with a strength. If the
    /// frame is `lost`, one of its pulses is not seen, so that the CRC will be wrong; `draw`
    /// chooses which.
    void reach(uint32_t station, uint32_t listener, distance_measurement_t strength, bool lost,
               uint64_t draw);

    /// Whether the light of a station reaches any board.
    bool reaches_any(uint32_t station) const {
        return station < reached_.size() && !reached_[station].empty();
    }

    /// A pulse of a station: the boards that it reaches see it.
    void pulse(uint32_t station, Cycles begin, Cycles end, bool begins = true);

    /// The pulses of a frame that begins at `at`: only the first, or all but the first.
    void first_pulse(uint32_t station, Cycles at);
    void other_pulses(uint32_t station, Cycles at, const message_t &message);

    /// Light that never goes out falls on every board.
    void hold_busy();

  private:
    /// An IR LED, as others see it.
    struct Lamp {
        uint32_t station;
        PulseReader reader = {};  ///< of its pulses
        Cycles on_since = NEVER;  ///< NEVER: it is off
        bool begins = false;      ///< since the last flash
    };
    /// A robot on a board, and the messages that come to it from outside the channel.
    struct Place {
        Place(Robot &own, const FlashImage &flash, Cycles power_up, const Chance &chance)
            : index(own.index()),
              robot(own),
              board(flash, index, own.calibration(), power_up, chance),
              lamp{index} {}

        uint32_t index;                  ///< of the robot
        Robot &robot;                    ///< what others see of it: LED, motors, messages
        RobotBoard board;                ///< the chip
        Lamp lamp;                       ///< its infrared LED
        std::string line;                ///< printed, not yet ended
        std::deque<Reception> messages;  ///< from outside the channel, to be shown
        Cycles light_free = 0;           ///< when the next may begin
        Cycles shown_until = 0;          ///< the end of the one that is being shown
        unsigned spoilt = 0;             ///< how often in vain
        bool shows = false;              ///< a message is being shown
        bool spoils = false;             ///< other light came between
        bool failed = false;             ///< its program cannot go on, and that was reported

        /// When the first message may begin.
        Cycles message_due() const { return std::max(messages.front().at, light_free); }
    };
    /// A module on a board; it keeps its EEPROM while it is without power.
    struct ModulePlace {
        uint32_t index;                    ///< in the grid
        Cycles tick;                       ///< length of its tick, in cycles
        EepromImage eeprom;                ///< when it was last without power
        std::optional<ModuleBoard> board;  ///< while it has power
        std::vector<Lamp> lamps;           ///< by cell
        std::string line;                  ///< printed, not yet ended
        bool powered = true;               ///< else it is dead
        bool on_bus = false;               ///< its controller's frame waits at its node
        bool failed = false;               ///< as Place::failed
    };
    /// A CAN frame that a module's controller has queued.
    struct QueuedFrame {
        uint32_t module;
        CanOutput output;
    };
    /// A board that sees a station.
    struct Reached {
        uint32_t listener;                ///< station
        distance_measurement_t strength;  ///< of the light there
        unsigned lost_pulse;              ///< the number of the one that is not seen, or NO_PULSE
        unsigned pulses = 0;              ///< so far
    };
    static constexpr unsigned NO_PULSE = ~0u;

    Place &place(uint32_t robot) { return places_[static_cast<size_t>(place_of_[robot])]; }
    bool is_cell(uint32_t station) const { return station >= robots_.size(); }
    ModulePlace &module_of(uint32_t station) {
        return modules_[GridLayout::module_of(station - static_cast<uint32_t>(robots_.size()))];
    }
    uint8_t cell_of(uint32_t station) const {
        return GridLayout::index_in_module(station - static_cast<uint32_t>(robots_.size()));
    }
    /// Passes over quanta in which nothing comes of executing any board; false: the next is none.
    bool rest(Cycles until);
    /// A board that is to be looked at, or touched from outside: as if executed quantum by quantum.
    RobotBoard &up_to_date(Place &place);
    ModuleBoard &up_to_date(ModulePlace &module);
    /// Until when a board that has been executed need not be: 0, or later than that.
    template <typename Board> static Cycles rest_of(const Board &board, const Lamp &lamp);
    /// Light falls on a robot's or a cell's receiver.
    void shine(uint32_t station, const LightPulse &pulse);
    /// All boards, one after the other: none sees what another sends within this quantum.
    void execute(Cycles until);
    void execute(ModulePlace &module, Cycles until);
    /// Takes from robots' inboxes what came from outside the channel.
    void take_messages();
    /// Shows a message as light, and finds whether it was spoilt.
    void shine_message(Place &place, Cycles begin);
    void end_message(Place &place);
    /// Hands on what a board has put out: light, LED, motors, bytes of its UART.
    void take_outputs(Place &place, Cycles until);
    // Flashes of an infrared LED, from its edges.
    void switch_lamp(Lamp &lamp, Cycles at, bool on);
    /// Its light since it went on becomes a flash.
    void add_flash(Lamp &lamp, Cycles end);
    /// A lamp that is still on at the end of a quantum.
    void rest(Lamp &lamp, Cycles until);
    Flash take_flash();

    Swarm<Robot> &robots_;
    const RobotContext &context_;
    std::deque<Place> places_;       ///< robots on boards, ascending; they do not move in memory
    std::vector<int32_t> place_of_;  ///< by robot; -1: none
    std::vector<uint32_t> robots_with_;               ///< those of places_
    std::vector<Place *> told_;                       ///< those with messages to be shown
    std::vector<Cycles> robots_rest_, modules_rest_;  ///< by place: nothing comes of executing it
                                                      ///< up to then
    std::deque<ModulePlace> modules_;                 ///< by index in the grid
    std::shared_ptr<const FlashImage> module_flash_;  ///< all modules run the same
    std::vector<QueuedFrame> queued_;                 ///< that have not reached a node yet
    Events module_events_;                            ///< since take_events()
    std::vector<std::vector<Reached>> reached_;       ///< by station
    std::deque<Flash> flashes_;                       ///< in order of time
    Cycles now_ = 0;
};

}  // namespace kilotwin

#endif
