/// The mock of the Kilogrid module API: one module's runtime around its program, which is a guest
/// like a robot's.
///
/// A module has four cells, each with lights, a transmitter and a receiver, and one CAN controller.
/// What its runtime does is hardware.md 3.2 to 3.4 and 3.7: states and their lights, infrared
/// commands repeated for robots, each cell's message once in 16 ticks, configuration, tracking
/// records kept for the next poll. As with a robot, the program takes no time, loop() is called
/// once a tick, and a module is run ahead up to a moment before which nothing from outside can
/// reach it.
#ifndef KILOTWIN_GUEST_MODULE_H
#define KILOTWIN_GUEST_MODULE_H

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/chance.h"
#include "engine/clock.h"
#include "engine/events.h"
#include "grid/can_frame.h"
#include "guest/busy_watch.h"
#include "guest/eeprom.h"
#include "guest/infrared_gains.h"
#include "guest/program.h"
#include "guest/stack.h"

namespace kilotwin {

constexpr uint8_t CELLS_PER_MODULE = 4;

/// What all modules of a grid share.
struct ModuleContext {
    const Chance &chance;
    Events &events;            ///< their prints and failures; `robot` is the module's index
    bool gains_are_mm = true;  ///< receptions carry the distance itself, as both gains
};

/// A frame for the bus.
struct CanOutput {
    Cycles at;  ///< when the controller has it
    CanFrame frame;
};

/// The LEDs of a cell: pulse widths of red, green and blue.
struct CellLight {
    std::array<uint8_t, 3> rgb{};

    /// The API's colour: bit 0 red, bit 1 green, bit 2 blue.
    uint8_t color() const {
        return static_cast<uint8_t>((rgb[0] != 0) | (rgb[1] != 0) << 1 | (rgb[2] != 0) << 2);
    }
    /// Of the brightest part.
    uint8_t brightness() const { return std::max({rgb[0], rgb[1], rgb[2]}); }
};

/// A frame that a module is about to send by infrared.
struct CellEmission {
    Cycles at;  ///< begin of the frame
    uint8_t cell;
    message_t message;
};

class Module {
  public:
    enum class State : uint8_t {
        INIT,
        IDLE,
        SETUP_KILOBOTS,
        WAITING_FOR_PAGE,
        BOOTLOADING_KILOBOTS,
        WAITING_FOR_CONFIGURATION,
        SETUP,
        RUNNING,
        BOOT_LOADER,  ///< the module's own
    };

    /// What becomes of a frame that the module is about to send.
    enum class Answer : uint8_t {
        SENT,       ///< it is on air from the time asked about on
        BUSY,       ///< light was seen: not sent, the attempt is over
        RECEIVING,  ///< the receiver is in the middle of a frame: it was not even tried
    };

    /// Frames and messages that were refused: they changed nothing.
    struct Counts {
        uint64_t bad_frames = 0;    ///< wrong length, configuration too long, page out of range ...
        uint64_t records_lost = 0;  ///< next_CAN_message() found the ring full
        uint64_t frames_missed = 0;  ///< came while the controller's two buffers were full
    };

    /// Module `index` at column `x`, row `y`, switched on at `power_up`; `tick` by its own
    /// oscillator. `image` holds its program's state: program->state_bytes() bytes of its own.
    /// Throws EngineError if `program` is not a module's.
    Module(ModuleContext &context, std::shared_ptr<Program> program, uint32_t index, uint8_t x,
           uint8_t y, Cycles tick, Cycles power_up, uint8_t *image);
    ~Module();
    Module(const Module &) = delete;
    Module &operator=(const Module &) = delete;

    /// To be called by a thread before it runs modules.
    static void serve_this_thread();

    /// Lives through everything strictly before `until`, but stops where it is about to send by
    /// infrared. Returns the time run up to: `until`, or that of the question.
    Cycles run(Cycles until);

    /// Whether it waits for answer(); then outgoing() is what it would send, at the time run up to.
    /// Carrier sense is by the receiver, that is on listening_cell(), not on the cell that sends.
    bool asks() const { return asking_ != Asking::NOTHING; }
    const CellEmission &outgoing() const { return outgoing_; }

    /// SENT keeps it deaf and busy for FRAME_CYCLES. The next run goes on from there. A cell that
    /// found the channel busy waits for its next turn.
    void answer(Answer answer);

    /// The earliest moment at which it may ask, or put a frame on the bus, if nothing reaches it
    /// before; NEVER if none. It may be left behind till then: what else it does is seen by nobody
    /// (its lights are right only as far as it was run).
    Cycles next_event() const;

    /// A frame that passed filters(), complete at `at`, not earlier than the time run up to.
    void receive_can(Cycles at, const CanFrame &frame);

    /// Identifiers that its controller takes: broadcast, its row, its column, its own.
    std::array<uint16_t, 4> filters() const;

    /// An infrared frame that ended at `at` on the cell listened to, with a right checksum or not.
    void receive_ir(Cycles at, uint8_t cell, const message_t &message,
                    distance_measurement_t distance, bool crc_error);

    /// A frame is coming in at the cell listened to from `begin` to `end`: the receiver stays with
    /// it. In order of time.
    void hold_receiver(Cycles begin, Cycles end);

    /// The cell that the receiver listens to at `at`: 10.24 ms each. Not before an earlier call's.
    uint8_t listening_cell(Cycles at);

    /// A power cycle at `at`, not earlier than the time run up to: starts from main() again. The
    /// EEPROM stays.
    void reset(Cycles at);

    uint32_t index() const { return index_; }
    uint8_t x() const { return x_; }
    uint8_t y() const { return y_; }
    Cycles now() const { return now_; }
    State state() const { return state_; }
    const char *state_name() const;
    bool stopped() const { return life_ == Life::STOPPED; }  ///< its program failed
    const Counts &counts() const { return counts_; }
    uint32_t ticks() const { return last_tick_; }  ///< module_ticks at its last tick

    /// What the LEDs of `cell` show at `at`, which it has been run up to.
    CellLight light(uint8_t cell, Cycles at) const;

    /// Its controller's error counters, for health reports.
    void set_can_errors(uint8_t tec, uint8_t rec) {
        tec_ = tec;
        rec_ = rec;
    }

    /// Frames for the bus, in order of time; the caller clears them.
    std::vector<CanOutput> can_frames;

  private:
    enum class Life : uint8_t { OFF, BOOTING, ALIVE, STOPPED };
    enum class Asking : uint8_t { NOTHING, TURN, AT_ONCE };  ///< why it is about to send

    struct CanReception {
        Cycles at;
        CanFrame frame;
    };
    struct CellReception {
        Cycles at;
        message_t message;
        distance_measurement_t distance;
        uint8_t cell;
        bool crc_error;
    };

    uint32_t index_;
    uint8_t x_, y_;
    Cycles now_;
    uint32_t last_tick_ = 0;
    uint8_t tec_ = 0, rec_ = 0;
    State state_ = State::INIT;
    Life life_ = Life::OFF;
    Asking asking_ = Asking::NOTHING;
    CellEmission outgoing_{};
    Counts counts_;
};

}  // namespace kilotwin

#endif
