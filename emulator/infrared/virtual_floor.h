/// Stands in for the foot-bot's ground sensor and proximity ring: tells each robot by a CELL
/// message what it stands on and whether something is close ahead (design.md 5). Outside the
/// medium: it is lossless and takes no air time.
///
/// A control step that senses between two world steps does so at the next one. A message goes out
/// when what it says changes, and at least every `repeat_ticks`.
#ifndef KILOTWIN_INFRARED_VIRTUAL_FLOOR_H
#define KILOTWIN_INFRARED_VIRTUAL_FLOOR_H

#include <vector>

#include "aggregation/wire.h"
#include "base/clock.h"
#include "robots/robot.h"

namespace kilotwin {

/// One per run with `swarm.floor`; simulation/floor_sensing.h finds what robots sense.
class VirtualFloor {
  public:
    struct Settings {
        double obstacle_m;      ///< surface to surface
        uint32_t step_ticks;    ///< between two sensings
        uint32_t repeat_ticks;  ///< after which the same is sent again
    };

    /// Senses from `begin` on, at the boundaries of world steps of `world_step`.
    VirtualFloor(const Settings &settings, Cycles begin, Cycles world_step, size_t robots);

    /// How near an obstacle ahead has to be.
    double obstacle_m() const { return settings_.obstacle_m; }

    /// Whether robots sense at the world step's boundary `at`.
    bool senses_at(Cycles at) const;

    /// The first sensing after `at`.
    Cycles next_sensing(Cycles at) const;

    /// `robot` senses `cell` at `at`, and nothing else will be sensed until `until`: gives it the
    /// messages due.
    void tell(Robot &robot, wire_cell_t cell, Cycles at, Cycles until) {
        Told &told = told_[robot.index()];
        if (cell.site != told.cell.site || cell.flags != told.cell.flags) told = {cell, 0};
        if (told.due < until) give(robot, told, at, until);
    }

  private:
    struct Told {
        wire_cell_t cell = {0, 0};
        Cycles due = 0;  ///< the sensing at which the same is told again
    };

    void give(Robot &robot, Told &told, Cycles at, Cycles until);

    Settings settings_;
    Cycles begin_, world_step_;
    Cycles longest_gap_;      ///< between two sensings
    std::vector<Told> told_;  ///< by robot
};

}  // namespace kilotwin

#endif
