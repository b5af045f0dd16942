/// One program on both tiers, compiled for this computer and on an ATmega328P, given the same messages, distances,
/// light and random bytes at the same ticks: what they decide must be the same.
///
/// Decisions are what others can see: LED, motors, messages. Messages that come in begin in the second quarter of a
/// tick and end in its middle, when neither robot sends. A neighbour says what the program itself said lately, with
/// a byte changed now and then, or small random numbers; it talks in spells, and is silent in others. The light
/// changes where ticks begin. All of it follows from the seed.
#ifndef KILOTWIN_AVR_TWINS_H
#define KILOTWIN_AVR_TWINS_H

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "avr/boards/robot_board.h"
#include "avr/chip/call_watch.h"
#include "avr/chip/flash_image.h"
#include "base/chance.h"
#include "guest/robot.h"
#include "infrared/infrared_pulses.h"

namespace kilotwin {

class Twins {
  public:
    struct Settings {
        uint64_t seed = 1;
        uint16_t uid = 7;
        std::vector<message_t> before_run;  ///< told one a tick; CRCs are made
        /// A decision may come so much earlier or later, in the same order; 0: it has to be in the same tick.
        Cycles slack = 0;
        /// And so much more as interrupts may have taken since RUN: the program waits by delay(), which lasts
        /// longer by that on the robot.
        bool waits = false;
        /// Byte addresses of functions: follows the chip from main() on, several times slower, and measures their
        /// calls.
        std::optional<std::vector<uint16_t>> follow;
    };

    /// What both do, by kind. Each kind has an order of its own.
    enum Kind : uint8_t { LED, MOTORS, MESSAGE, KINDS };
    struct Decision {
        uint32_t tick;  ///< since power-up
        Cycles at;
        std::vector<uint8_t> value;  ///< RGB(); left, right; data, type and CRC
        std::string text(Kind kind) const;
    };

    /// What one did and the other did not, at that time. Without a value: nothing.
    struct Difference {
        uint32_t tick;
        Kind kind;
        std::optional<Decision> native, avr;
        std::string text() const;
    };

    /// `image` has to be an ELF file's. Throws EngineError if the program does not get to kilo_init().
    Twins(Program &program, std::shared_ptr<const FlashImage> image, const Settings &settings);
    Twins(const Twins &) = delete;
    Twins &operator=(const Twins &) = delete;

    /// Goes on by so many ticks, or until the chip cannot go on.
    void live(uint32_t ticks);

    uint32_t tick() const { return tick_; }
    uint64_t compared() const { return compared_; }        ///< decisions of both that agreed
    uint64_t heard() const { return heard_; }              ///< messages told
    Cycles worst_lag() const { return worst_lag_; }        ///< of decisions that agreed
    uint32_t ticks_apart() const { return ticks_apart_; }  ///< the most of decisions that agreed

    /// The first one; nothing is compared after it, nor after a failure.
    const std::optional<Difference> &difference() const { return difference_; }

    /// Why either cannot go on; empty: it can.
    const std::string &avr_failure() const { return board_.failure(); }
    std::string native_failure() const;
    const Events &native_events() const { return events_; }

    /// What the program takes of the chip; null unless it is followed.
    const CallWatch *watch() const { return watch_.get(); }

    /// Of the chip, which was followed, up to now: an interrupt took longer, or they were off.
    uint64_t ticks_lost() const;

  private:
    /// Decisions of one, settled and not compared yet.
    struct Side {
        std::array<std::deque<Decision>, KINDS> decided;
        std::array<std::vector<uint8_t>, KINDS> standing;  ///< LED and motors at present
        std::array<std::optional<Decision>, KINDS> fresh;  ///< may still change within SETTLE
    };

    void find_first_tick();
    void live_tick();
    void tell(const message_t &message, distance_measurement_t strength);
    std::optional<message_t> next_message();
    uint64_t draw() { return chance_.bits(0, Purpose::TWIN_INPUT, draws_++); }
    uint64_t below(uint64_t limit) { return draw() % limit; }
    int16_t convert(uint8_t channel, int16_t reading);

    void run_native(Cycles until);
    void take_native(Cycles from);
    void take_avr();
    void see(Side &side, Kind kind, Cycles at, std::vector<uint8_t> value);
    void settle(Side &side, Cycles now);
    void compare(Cycles now);
    bool same_time(const Decision &native, const Decision &avr) const;
    uint32_t tick_at(Cycles at) const;
    Cycles allowed(Cycles at) const;

    Settings settings_;
    Chance chance_;
    std::shared_ptr<const FlashImage> image_;
    Calibration calibration_;
    RobotBoard board_;
    std::unique_ptr<CallWatch> watch_;
    uint16_t rand_hard_ = 0;
    Cycles base_ = 0;  ///< of tick 0
    Events events_;
    std::vector<Emission> emissions_;
    RobotContext context_;
    std::unique_ptr<uint8_t[]> state_;
    std::optional<Robot> native_;
    PulseReader reader_;
    Side native_side_, avr_side_;
    std::optional<Difference> difference_;
    std::deque<message_t> said_;  ///< lately, by the program
    uint32_t tick_ = 0, run_at_ = 0, spell_until_ = 0;
    unsigned talk_of_256_ = 0;
    int16_t light_ = 500;
    uint64_t draws_ = 0, compared_ = 0, heard_ = 0, sent_ = 0, noise_bits_ = 0;
    bool second_of_pair_ = false;
    Cycles worst_lag_ = 0;
    uint32_t ticks_apart_ = 0;
};

}  // namespace kilotwin

#endif
