/// Interface of the solvers that move the islands (islands.h) of a world step: disc_solver.h discs
/// alone, box2d_solver.h discs and objects. This base holds what both need: how finely a step is
/// divided, and how robots are kept out of walls.
#ifndef KILOTWIN_PHYSICS_CONTACT_ISLAND_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_ISLAND_SOLVER_H

#include <cstdint>
#include <vector>

#include "physics/arena.h"
#include "physics/contact/islands.h"

namespace kilotwin {

class IslandSolver {
  public:
    virtual ~IslandSolver() = default;
    IslandSolver(const IslandSolver &) = delete;
    IslandSolver &operator=(const IslandSolver &) = delete;

    /// Whether each share of a team has its own islands; else all are the first one's.
    virtual bool solves_by_shares() const = 0;

    /// Moves the bodies of all shares for `step_s`, a whole number of ticks: sets `moved` and the
    /// velocities. To be called once a world step, also without bodies: what is known of a body is
    /// kept as long as that body is in each call. Equal input, in equal order, gives equal bits,
    /// however islands are cut into shares.
    virtual void solve(std::vector<Islands> &shares, double step_s) = 0;

    /// Drops what is known of a robot that is elsewhere now.
    virtual void forget(uint32_t robot) = 0;

  protected:
    /// `arena` must live on.
    IslandSolver(const Arena &arena, const Mechanics &mechanics)
        : arena_(arena),
          mechanics_(mechanics) {}

    /// How a step is divided: into rounds, which look for contacts anew, so that no two robots
    /// close by more than SEEN_RADII within one; and these into sub-steps: 0.75 a tick, and up to 3
    /// when robots that overlap do so by more than 0.4 % of a diameter on average.
    struct Division {
        int rounds, sub_steps;
    };
    /// How close bodies of some islands come: the division depends on it.
    struct Closeness {
        /// Farthest that two close that are not seen as the step begins.
        double closing_m = 0;
        /// Sum of all overlaps: whole numbers, whose sum depends on no order.
        int64_t overlaps_pm = 0;
        int64_t overlapping = 0;  ///< how many overlap
        void add(const Closeness &other);
    };
    /// `swept_m`: how far the fastest object goes in the step; below 0 without objects. With them
    /// contacts are as stiff as can be.
    Closeness closeness(const Islands &islands, double swept_m) const;
    Division divide(const Closeness &of_all, double step_s, bool has_objects) const;

    /// Where a robot is moved to that overlaps too much with a wall: `at` if it does not.
    Eigen::Vector2d kept_off_walls(Eigen::Vector2d at) const;

    static constexpr double SEEN_RADII = 0.18;  ///< how far away a contact is found at least

    const Arena &arena_;
    const Mechanics mechanics_;
};

}  // namespace kilotwin

#endif
