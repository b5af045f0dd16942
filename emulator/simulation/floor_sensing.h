/// Messages of the virtual floor to robots: the site below each and whether an obstacle is ahead,
/// looked up again only when it may have changed.
///
/// How long a robot's surroundings stay as they are is bounded by the fastest that any robot moves.
/// That bound limits how far the robot is run ahead. Without a floor every call does nothing.
#ifndef KILOTWIN_SIMULATION_FLOOR_SENSING_H
#define KILOTWIN_SIMULATION_FLOOR_SENSING_H

#include <optional>
#include <vector>

#include "aggregation/wire.h"
#include "base/clock.h"
#include "infrared/virtual_floor.h"
#include "physics/arena.h"
#include "physics/bodies.h"
#include "robots/robot.h"

namespace kilotwin {

/// One per run. A world step calls begin_step(), then look() and tell() for each robot that is due,
/// disturb() for motor commands, and end_step().
class FloorSensing {
  public:
    /// A floor that senses from `begin` on, in world steps of `step`; no `settings`: there is none.
    /// `arena` and `bodies` must live on; `radius_m` is a robot's.
    FloorSensing(const std::optional<VirtualFloor::Settings> &settings, Cycles begin, Cycles step,
                 const Arena &arena, double radius_m, const Bodies &bodies);

    /// Whether there is a floor.
    bool exists() const { return floor_.has_value(); }

    /// A world step begins at `now`.
    void begin_step(Cycles now);

    /// Looks around for a robot if that is due (`always`: in any case), in O(neighbours). Returns
    /// until when it may be run ahead, at most `limit`.
    Cycles look(uint32_t robot, Cycles limit, bool always) {
        if (!floor_) return limit;
        Surroundings &around = surroundings_[robot];
        if (always || around.look_again <= now_) look_around(robot);
        return std::min(limit, std::max(around.unchanged_until, later_sensing_));
    }

    /// Whether robots sense before `end`, from the begin of the step on.
    bool tells_before(Cycles end) const { return floor_ && next_sensing_ < end; }

    /// Until when a robot may be executed, at most `limit`, without a look at what it senses then.
    Cycles not_beyond(Cycles limit) const {
        return floor_ ? std::min(limit, later_sensing_) : limit;
    }

    /// After look(): gives the robot in a slot, which is about to be executed up to `until`, its
    /// messages.
    void tell(uint32_t slot, Robot &robot, Cycles until) {
        if (next_sensing_ < until)
            floor_->tell(robot, surroundings_[slot].cell, next_sensing_, until);
    }

    /// A robot's motors are ordered otherwise at `at`: what it and those around it sense may
    /// change.
    void disturb(uint32_t robot, Cycles at) {
        if (floor_) look_again_around(robot, begin_of_step(at, step_) + step_);
    }

    /// Robots are elsewhere than they were: all look around when they are due.
    void look_again() {
        for (Surroundings &around : surroundings_) around.look_again = 0;
    }

    /// Robots were pushed in the step that ends at `now`.
    void end_step(Cycles now);

  private:
    /// Message of the floor when a robot last looked around, and how long it holds.
    struct Surroundings {
        Cycles look_again = 0;       ///< before this nothing in it can change
        Cycles unchanged_until = 0;  ///< nor before this, whichever robots begin to move
        wire_cell_t cell = {0, 0};   ///< what it tells then
    };
    /// The gaps to whatever is near a robot: squares of distances between centres.
    struct Nearest {
        double robot = INFINITY, mover = INFINITY;  ///< of any, and of those that move
        bool obstacle = false;                      ///< one is close ahead
    };

    void look_around(uint32_t robot);
    Nearest nearest_to(uint32_t robot) const;
    /// The robot and those on its list look around again by `at`.
    void look_again_around(uint32_t robot, Cycles at);
    /// Distance of centres at which another robot becomes an obstacle.
    double near_m() const { return 2 * radius_m_ + floor_->obstacle_m(); }

    std::optional<VirtualFloor> floor_;
    Cycles step_;
    const Arena &arena_;
    double radius_m_;
    const Bodies &bodies_;
    std::vector<Surroundings> surroundings_;  ///< by robot
    Cycles now_ = 0;
    Cycles next_sensing_ = NEVER;   ///< from now_ on
    Cycles later_sensing_ = NEVER;  ///< after now_
};

}  // namespace kilotwin

#endif
