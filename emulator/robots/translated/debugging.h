/// A debugger's hold on robots that run translated: it looks before each of their instructions
/// whether one is wanted, and then lets the host act while everything stands still.
///
/// Such a robot is executed by code of its own, made with DEBUGGED (translated/code.h): the same
/// blocks, so that the run stays the same to the bit. Passes that repeat are left out as ever, but
/// for those in which something wanted happens, which count as changed; known passes are not.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_DEBUGGING_H
#define KILOTWIN_ROBOTS_TRANSLATED_DEBUGGING_H

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "base/registers.h"

namespace kilotwin {

class Debugging {
  public:
    /// The begin of an instruction: a robot, and its own cycles since power-up. No two instructions
    /// of a robot have the same.
    struct Place {
        uint32_t robot;
        uint64_t cycle;
    };
    enum class Why : uint8_t { NOTHING, STEP, PLACE, BREAKPOINT, WATCH, MESSAGE, COLOUR, CRASH };
    /// Bytes of a robot's data space, in which a change is wanted.
    struct Watch {
        uint16_t address, bytes;
    };
    /// Causes for which robots that are held are to stop.
    struct Wanted {
        std::vector<uint32_t> breakpoints;  ///< byte addresses of instructions
        std::vector<Watch> watches;
        bool step = false;              ///< each instruction
        bool message = false;           ///< the begin of the program's callback for a message
        std::optional<uint8_t> colour;  ///< the LED's becoming that RGB() value
        bool only_notes = false;        ///< the last place is kept, and nothing stands still
        std::optional<Place> until;     ///< the first instruction from there on, in any case
    };
    /// A place at which something was wanted. Of a change it is the instruction that has made it,
    /// which is over by then, or the last one before the engine has.
    struct Found {
        Place place;
        Why why;
        uint32_t watch;  ///< of Why::WATCH, its number
    };
    /// All stands still before an instruction.
    /// `before`: cycle of the robot's instruction before, if no passes were left out between them;
    /// so near a place that is wanted, and from the first stop on.
    struct Stop {
        Place place;
        uint32_t pc;
        Why why;
        uint32_t watch;
        uint64_t before;
    };
    /// An instruction that is about to begin.
    struct Instruction {
        Place place;
        uint32_t pc;
        const uint8_t *data;
        uint8_t colour;
        bool begins_callback;
    };

    /// For so many robots, of which none is held. `on_stop` must not throw.
    Debugging(size_t robots, std::function<void(const Stop &)> on_stop)
        : held_(robots),
          on_stop_(std::move(on_stop)) {}

    /// Takes hold of a robot, between two of its runs.
    void hold(uint32_t robot) { held_[robot].is_held = true; }
    bool holds(uint32_t robot) const { return held_[robot].is_held; }

    /// From the next instruction on. Within `on_stop` from the one that is about to begin.
    void want(const Wanted &wanted);
    /// The last place before now, since want(), at which something was wanted.
    const std::optional<Found> &last() const { return last_; }
    /// Before an instruction. True if something was wanted there.
    bool look(const Instruction &now);
    /// Between two runs of a robot that is held: what its last instruction has changed.
    void look_behind(const Instruction &now);
    /// A robot's program has failed at that instruction.
    void failed(const Instruction &now);
    /// The robot whose instruction is about to begin, and where; none if all are between two runs.
    const std::optional<Stop> &standing() const { return standing_; }

    /// Cycles of a robot up to which passes may be left out, and from which on none may: a moment
    /// before the place that is wanted. NO_PLACE if there is none.
    static constexpr uint64_t NO_PLACE = UINT64_MAX;
    uint64_t executes_from(uint32_t robot) const;
    /// Whether each turn of inner loops is executed (passes/loops.h): one of it may be wanted.
    bool wants_turns() const { return wanted_.step || !wanted_.breakpoints.empty(); }

  private:
    struct Held {
        bool is_held = false;
        bool knows = false;  ///< colour and bytes are those of the last look
        uint8_t colour = 0;
        uint64_t cycle = 0;  ///< of the last look
        uint32_t pc = 0;
        std::vector<uint8_t> bytes;  ///< of all watches, one after the other
    };

    /// The change since the last look; the watch's number in `watch`.
    Why change_of(Held &held, const Instruction &now, uint32_t &watch) const;
    void remember(Held &held, const Instruction &now) const;
    void stop(const Instruction &now, Why why, uint32_t watch, uint64_t before);

    std::vector<Held> held_;
    std::function<void(const Stop &)> on_stop_;
    Wanted wanted_;
    std::vector<uint8_t> breaks_at_ = std::vector<uint8_t>(atmega328p::FLASH_BYTES / 2);
    std::optional<Found> last_;
    std::optional<Stop> standing_;
};

}  // namespace kilotwin

#endif
