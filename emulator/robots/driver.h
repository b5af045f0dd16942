/// Drivers: what executes the programs of a group of robots. There is one for each tier (tier.h),
/// and one object for a group, which speaks for all of its robots: native/driver.h,
/// translated/driver.h, avr/boards/chip_driver.h.
///
/// Records of all robots are one array (record.h); what a driver needs of a robot besides lies in
/// memory of its own.
#ifndef KILOTWIN_ROBOTS_DRIVER_H
#define KILOTWIN_ROBOTS_DRIVER_H

#include <memory>
#include <string>
#include <vector>

#include "base/errors.h"
#include "robots/record.h"
#include "robots/tier.h"

namespace kilotwin {

class Driver {
  public:
    /// State of a robot besides its record, copied.
    struct Kept {
        virtual ~Kept() = default;
    };

    virtual ~Driver() = default;
    Driver(const Driver &) = delete;
    Driver &operator=(const Driver &) = delete;

    Tier tier() const { return tier_; }
    const std::string &name() const { return name_; }  ///< of the program
    /// The file that the program was loaded from.
    const std::string &path() const { return path_; }
    /// Whether its program can tell that light falls on its receiver, and disturb() is to be
    /// called. A board sees for itself.
    bool heeds_light() const { return heeds_light_; }
    /// Bytes of a robot's own state, which every run needs, from `own` on: to be prefetched.
    size_t own_bytes() const { return own_bytes_; }
    /// Whether a robot can be kept, run on tentatively and restored.
    bool can_restore() const { return can_restore_; }

    /// Makes the state of the group's next robot, switched on at its time. The record must stay
    /// where it is.
    virtual void switch_on(RobotRecord &robot) = 0;
    virtual void switch_off(RobotRecord &robot) = 0;

    /// Executes a robot up to its `until`, later than `now`, or to a question. It is not stopped
    /// and waits for no answer.
    virtual void run(RobotRecord &robot) = 0;

    /// Its kilo_ticks go on by so many, between two runs, while it waits for RUN. A board's do not.
    virtual void count_on(RobotRecord & /*robot*/, uint32_t /*ticks*/) {}

    /// The earliest moment at which its program may be requested for a message, or its runtime
    /// answers a question; NEVER if only a command changes that.
    virtual Cycles next_ask(const RobotRecord &robot) const = 0;

    /// A message has been put into its inbox that is no light: it comes beside the medium, and is
    /// never missed.
    virtual void received_beside(RobotRecord & /*robot*/, Cycles /*at*/) {}

    /// The light of a frame falls on its receiver, from `begin` on.
    virtual void disturb(RobotRecord & /*robot*/, Cycles /*begin*/, const message_t & /*message*/) {
    }

    /// Its chip between two of its runs: data space, flags from C to I, program counter as a byte
    /// address, and its own cycle.
    struct Standing {
        const uint8_t *data, *flags;
        uint32_t pc;
        uint64_t cycle;
    };
    /// EngineError where programs do not run translated.
    virtual Standing standing(const RobotRecord & /*robot*/) const {
        throw EngineError(name_ + " does not run translated: no debugger can hold it");
    }
    /// A debugger takes hold of a robot (translated/debugging.h). Errors likewise.
    virtual void begin_hold(RobotRecord &robot) { standing(robot); }

    /// RGB() value of its LED at `at`, the time run up to.
    virtual uint8_t color(const RobotRecord &robot, Cycles /*at*/) const { return robot.color; }

    /// A copy of its program's variables; empty if they are not known.
    virtual std::vector<uint8_t> variables(const RobotRecord &robot) const = 0;

    // Only if can_restore().
    virtual std::unique_ptr<Kept> make_kept() const { return nullptr; }
    virtual void keep(const RobotRecord & /*robot*/, Kept & /*kept*/) const {}
    virtual void restore(RobotRecord & /*robot*/, const Kept & /*kept*/) const {}
    /// Whether a run of it can be undone now.
    virtual bool can_undo(const RobotRecord & /*robot*/) const { return false; }

  protected:
    Driver(Tier tier, std::string name, std::string path)
        : tier_(tier),
          name_(std::move(name)),
          path_(std::move(path)) {}

    size_t own_bytes_ = 0;
    bool heeds_light_ = false, can_restore_ = false;

  private:
    Tier tier_;
    std::string name_, path_;
};

}  // namespace kilotwin

#endif
