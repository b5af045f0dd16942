/// Drivers of modules: what executes the program of a grid's modules. There is one for modules as
/// guests (guest_modules.h) and one for modules on boards (avr/boards/boards.h).
///
/// The grid gives modules power, connects them to their buses, and asks how they are. Calls are per
/// frame or fault; modules are named by index, and times are not earlier than the module has been
/// executed.
#ifndef KILOTWIN_MODULES_DRIVER_H
#define KILOTWIN_MODULES_DRIVER_H

#include <cstdint>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "base/events.h"
#include "modules/module.h"

namespace kilotwin {

/// Error counters of a module's node on its bus.
struct CanErrors {
    uint32_t transmit, receive;
    bool bus_off;
};

/// The buses, as modules see them: each module has a node on one of them.
class ModuleNodes {
  public:
    virtual ~ModuleNodes() = default;

    /// Queues a frame at the module's node; it is counted as lost there if it cannot be.
    virtual void queue(uint32_t module, const CanOutput &output) = 0;
    virtual size_t queued(uint32_t module) const = 0;  ///< frames that wait at its node
    virtual CanErrors errors(uint32_t module) const = 0;
    virtual bool sends(uint32_t module) const = 0;  ///< false: its node is bus-off or dead
};

class ModuleDriver {
  public:
    virtual ~ModuleDriver() = default;
    ModuleDriver(const ModuleDriver &) = delete;
    ModuleDriver &operator=(const ModuleDriver &) = delete;

    /// How a module is. What one on a board makes of itself, only its answers by CAN tell.
    struct About {
        const char *state;        ///< of its runtime, by name
        bool stopped;             ///< its program crashed, or never returns
        uint32_t ticks;           ///< since power-up
        uint64_t frames_refused;  ///< by its transfers
        uint64_t frames_missed;   ///< its buffers were full
    };

    /// The outcome of executing a module.
    struct Ran {
        std::optional<CellEmission> asks;  ///< what it is about to send: it waits for answer()
        uint64_t unheard = 0;              ///< frames that went out where no robot is near
    };

    /// Whether its program may address other modules.
    bool acts_alone() const { return acts_alone_; }

    /// Adds the next module, in order of index, at column `x`, row `y`. `tick` is the length of its
    /// tick by its own oscillator, in cycles.
    virtual void add(uint8_t x, uint8_t y, Cycles tick, Cycles power_up) = 0;
    /// On where it is on: a power cycle. The EEPROM stays.
    virtual void set_power(uint32_t module, Cycles at, bool on) = 0;

    /// Identifiers that its controller takes; none: it filters by itself.
    virtual std::vector<uint16_t> filters(uint32_t module) const = 0;
    /// A frame of another node ends at `at`.
    virtual void receive_can(uint32_t module, Cycles at, const CanFrame &frame,
                             const CanErrors &errors) = 0;
    /// The first frame that it has queued ended on the bus.
    virtual void frame_sent(uint32_t /*module*/, Cycles /*at*/) {}
    /// Queues what has waited since the last call; what run() sends it queues by itself.
    virtual void pass_frames(ModuleNodes & /*nodes*/) {}

    /// Light of a cell, 0 to 3, at `at`, up to which all has been executed but by catch_up().
    virtual CellLight light(uint32_t module, uint8_t cell, Cycles at) = 0;
    virtual About about(uint32_t module) = 0;
    /// Prints and failures since the last call; `robot` is the module's index.
    virtual Events take_events() = 0;

    // Modules that the grid executes in the order of time. Boards have a lock-step of their own.

    /// When it has to be executed next; NEVER while it waits for an answer.
    virtual Cycles next_event(uint32_t /*module*/) const { return NEVER; }
    /// Executes it strictly before `until`, or to where it is about to send near a robot.
    /// Unless `heard`, no robot is near. What it sends by CAN is queued.
    virtual Ran run(uint32_t /*module*/, Cycles /*until*/, bool /*heard*/,
                    ModuleNodes & /*nodes*/) {
        return {};
    }
    /// The fate of what it was about to send at `asked`; false if it no longer asks.
    virtual bool answer(uint32_t /*module*/, Cycles /*asked*/, Module::Answer /*answer*/) {
        return false;
    }
    /// Executes a module that was left behind: no robot receives what it does up to `at`.
    virtual void catch_up(uint32_t /*module*/, Cycles /*at*/) {}
    /// A frame of a robot ended at `at` at a cell that listened. A board sees its light instead.
    virtual void receive_ir(uint32_t /*module*/, Cycles /*at*/, uint8_t /*cell*/,
                            const message_t & /*message*/, distance_measurement_t /*distance*/,
                            bool /*crc_error*/) {}

  protected:
    ModuleDriver() = default;

    bool acts_alone_ = false;
};

}  // namespace kilotwin

#endif
