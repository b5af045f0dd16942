/// The contacts of robots with one another and with the walls.
///
/// Only robots near a contact are in here. One alone at a wall, or two alone, go on in closed form
/// (encounter.h); three and more are a crowd, which a solver moves (contact_solver.h). Lengths in
/// metres.
#ifndef KILOTWIN_PHYSICS_WORLD_H
#define KILOTWIN_PHYSICS_WORLD_H

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/prefetch.h"
#include "physics/arena.h"
#include "physics/chassis.h"
#include "physics/contact/contact_solver.h"
#include "physics/contact/encounter.h"
#include "physics/motion.h"

namespace kilotwin {

/// A robot of World::robots() when a step begins.
struct Near {
    /// What it may touch within the step.
    enum class Company : uint8_t { NOTHING, WALL, ROBOT, SEVERAL };

    Pose pose;
    Shift free;        ///< where it would go within the step, were it alone
    Shift moved = {};  ///< where it went, after World::step()
    Company company = Company::SEVERAL;
    bool at_wall = false;           ///< it may touch one
    uint32_t other = 0;             ///< ROBOT: which of robots(), which has this one in turn
    uint32_t member = 0;            ///< SEVERAL: its number in the crowd, from World::step() on
    Eigen::Vector2d towards{1, 0};  ///< WALL, ROBOT: unit vector to it
    double gap_m = 0;               ///< and from rim to rim
};

class World {
  public:
    /// `drive_m_s`: the speed of the fastest drive; `fastest_m_s`: nobody is pushed faster.
    World(const Arena &arena, const Profile &profile, SolverKind solver, double drive_m_s,
          double fastest_m_s, size_t robots);

    /// Brings into the cache what step() needs of a robot.
    void prefetch(uint32_t robot) const { prefetch_line(&driven_[robot]); }

    bool holds(uint32_t robot) const { return held_[robot]; }

    /// Robots in the solver, ascending.
    const std::vector<uint32_t> &robots() const { return robots_; }

    /// Takes a robot in, moving as it does at `at`.
    void add(uint32_t robot, const Trajectory &trajectory, Cycles at);
    void remove(uint32_t robot);

    /// To be called after add() and remove(), before robots() and step().
    void settle();

    /// Moves all for `step_s`. `near`: each of robots(), in their order; `pairs`: of these, who may
    /// touch each other, ascending.
    void step(std::vector<Near> &near, const std::vector<Crowd::Pair> &pairs, double step_s);

  private:
    bool firm(const Near &near) const;
    Party drive(size_t i, Near &near, double step_s);
    void meet_wall(size_t i, Near &near, double step_s);
    void meet(size_t i, Near &one, size_t k, Near &other, double step_s);
    void join_crowd(size_t i, Near &near);
    std::vector<Driven> driven_;
    std::vector<uint8_t> held_;  ///< whether it is in robots_
    std::vector<uint32_t> robots_;
    bool gives_way_;
    Encounter encounter_;
    Mechanics::Change force_{};  ///< in this step
    std::unique_ptr<ContactSolver> solver_;
    Crowd crowd_;
    size_t added_ = 0;      ///< since settle(), to the end of robots_
    bool removed_ = false;  ///< since settle(), somebody
};

}  // namespace kilotwin

#endif
