/// A differential test of two tiers: one program compiled for this computer, or translated, and the
/// same program on an ATmega328P get the same messages, distances, light and random bytes at the
/// same ticks, and what they decide is compared. A translated one, called native below as well, is
/// switched on with the chip, and draws the noise of its converter as the chip does.
///
/// Decisions are the outputs that another robot or a camera can see: LED, motors, messages. The
/// inputs follow from the seed alone:
/// - Messages begin in the second quarter of a tick and end in its middle, when neither robot
/// sends. They repeat what the program itself sent lately, with a byte changed now and then, or
/// hold small random numbers, and come in spells of different density, some of them silent.
/// - Ambient light is a random walk that steps where ticks begin.
///
/// A tick costs what the chip executes in it; following the chip (Settings::follow) makes that
/// several times slower.
#ifndef KILOTWIN_AVR_DIFFERENTIAL_TEST_H
#define KILOTWIN_AVR_DIFFERENTIAL_TEST_H

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "avr/boards/robot_board.h"
#include "avr/call_watch.h"
#include "avr/chip/flash_image.h"
#include "base/chance.h"
#include "infrared/infrared_pulses.h"
#include "physics/motor_pair.h"
#include "robots/robot.h"

namespace kilotwin {

/// One run of one program. Belongs to the thread that made it.
class DifferentialTest {
  public:
    struct Settings {
        uint64_t seed;  ///< of all inputs
        uint16_t uid;
        std::vector<message_t> before_run;  ///< given one a tick, ahead of RUN; CRCs are filled in
        /// Tolerance: equal decisions may be so far apart. 0: they have to fall in the same tick.
        Cycles slack;
        /// The program waits by delay(), which interrupts prolong on the chip and not here: the
        /// tolerance grows by what they may have taken since RUN.
        bool waits;
        /// Byte addresses of functions whose calls are measured; the chip is then followed
        /// instruction by instruction from main() on (CallWatch).
        std::optional<std::vector<uint16_t>> follow;
        /// Sums that are watched for a carry, of a chip that is followed.
        std::vector<CallWatch::Sum> sums = {};
        /// A message that comes so many ticks after RUN, in place of those that follow from the
        /// seed.
        struct Heard {
            uint32_t tick;
            message_t message;
            uint8_t distance_mm;
        };
        /// In order of time; one a tick is given, others a tick later. Empty: by the seed.
        std::vector<Heard> heard = {};
        /// From tick to tick of a question for vitals, which both answer; 0: there is none. The
        /// voltage that they tell is the same only if the chip is followed.
        uint32_t ask_every = 0;
    };

    /// Decisions are compared in their order, each kind for itself.
    enum Kind : uint8_t { LED, MOTORS, MESSAGE, KINDS };
    struct Decision {
        uint32_t tick;               ///< since power-up
        Cycles at;                   ///< world time
        std::vector<uint8_t> value;  ///< RGB(); left, right; data, type and CRC
        /// The decision, for people: "motors 70 and 0".
        std::string text(Kind kind) const;
    };

    /// A decision of one tier that the other does not share. A side without a value did nothing.
    struct Difference {
        uint32_t tick;
        Kind kind;
        std::optional<Decision> native, avr;
        /// Both sides, for people.
        std::string text() const;
    };

    /// Powers both up and runs to the first tick of kilo_init(). `driver`, for one robot, is native
    /// or translated; `image` has to be of an ELF file. Throws EngineError if the program does not
    /// reach kilo_init() within 10 s. Belongs to the thread that made it.
    DifferentialTest(std::unique_ptr<Driver> driver, std::shared_ptr<const FlashImage> image,
                     const Settings &settings);
    DifferentialTest(const DifferentialTest &) = delete;
    DifferentialTest &operator=(const DifferentialTest &) = delete;

    /// Runs both by so many ticks, or until the chip cannot go on.
    void run(uint32_t ticks);

    uint32_t tick() const { return tick_; }          ///< nominal ticks since power-up
    uint64_t compared() const { return compared_; }  ///< pairs of decisions that agreed
    uint64_t received() const { return received_; }  ///< messages given to both
    // Frames of the chip since RUN: all, and those with a checksum that is wrong.
    uint64_t chip_sent() const { return chip_sent_; }
    uint64_t chip_sent_badly() const { return chip_sent_badly_; }
    /// Seconds that the chip's motors were on while neither turned, for want of a kick.
    double hummed_s() const { return motors_.hummed_s(board_.now()); }

    // The farthest apart of the pairs that agreed: time, and ticks.
    Cycles worst_lag() const { return worst_lag_; }
    uint32_t ticks_apart() const { return ticks_apart_; }

    /// The first difference; nothing is compared after it, nor after a failure.
    const std::optional<Difference> &difference() const { return difference_; }

    /// Why a tier cannot go on; empty: it can.
    const std::string &avr_failure() const { return board_.failure(); }
    std::string native_failure() const;
    /// Events of the native robot: prints, mistakes, failures.
    const Events &native_events() const { return events_; }

    /// Stack and calls on the chip; null unless it is followed.
    const CallWatch *watch() const { return watch_.get(); }

    /// Ticks that the chip, which is followed, has not counted up to now: another interrupt took
    /// longer than a tick, or interrupts were off.
    uint64_t ticks_lost() const;

  private:
    /// One tier: its decisions that are not compared yet, and its outputs.
    struct Side {
        std::array<std::deque<Decision>, KINDS> decided;
        std::array<std::vector<uint8_t>, KINDS> standing;  ///< LED and motors, settled
        std::array<std::optional<Decision>, KINDS>
            fresh;  ///< not yet settled: may change within SETTLE
    };

    /// Runs the chip to the first tick of kilo_init(), which gives base_.
    void find_first_tick();
    void run_tick();
    void give(const message_t &content, distance_measurement_t strength);
    /// Gives the message of `heard` that begins in this tick, if one does.
    void give_heard();
    /// The message that begins in this tick, if one does.
    std::optional<message_t> next_message();
    message_t question();
    uint64_t draw() { return chance_.bits(0, Purpose::DIFFERENTIAL_INPUT, draws_++); }
    uint64_t below(uint64_t limit) { return draw() % limit; }
    int16_t noisy_reading(uint8_t channel, int16_t reading);

    void run_native(Cycles until);
    void collect_native(Cycles from);
    void collect_avr();
    /// Records an output of a side at `at`, unless comparing has not begun or is over.
    void observe(Side &side, Kind kind, Cycles at, std::vector<uint8_t> value);
    void settle(Side &side, Cycles now);
    /// Pairs decisions off and finds the first difference, up to `now`.
    void compare(Cycles now);
    bool same_time(const Decision &native, const Decision &avr) const;
    /// The tick of a moment in world time.
    uint32_t tick_at(Cycles at) const;
    Cycles allowed(Cycles at) const;

    Settings settings_;
    Chance chance_;
    std::shared_ptr<const FlashImage> image_;
    Calibration calibration_;
    RobotBoard board_;
    std::unique_ptr<CallWatch> watch_;
    uint16_t rand_hard_ = 0;  ///< its address; the chip's noise is replaced inside it
    Cycles base_ = 0;         ///< world time of tick 0
    Events events_;
    std::vector<Emission> emissions_;
    RobotContext context_;
    std::unique_ptr<Driver> driver_;
    std::optional<Robot> native_;
    PulseReader reader_;
    Side native_side_, avr_side_;
    std::optional<Difference> difference_;
    // Inputs.
    size_t heard_next_ = 0;         ///< of Settings::heard
    std::deque<message_t> recent_;  ///< messages that the program sent lately
    uint32_t tick_ = 0, run_at_ = 0, spell_until_ = 0;
    unsigned talk_of_256_ = 0;  ///< of 256 ticks, how many have a message in this spell
    int16_t light_ = 500;
    uint64_t draws_ = 0, compared_ = 0, received_ = 0, sent_ = 0, noise_bits_ = 0;
    uint64_t chip_sent_ = 0, chip_sent_badly_ = 0;
    MotorPair motors_;  ///< the chip's
    bool second_of_pair_ = false;
    Cycles worst_lag_ = 0;
    uint32_t ticks_apart_ = 0;
};

}  // namespace kilotwin

#endif
