/// The contacts of robots with one another and with the walls. Only world.cpp knows Box2D's types.
///
/// Only robots near a contact are in here. One alone at a wall, or two alone, go on in closed form
/// (encounter.h); three and more are solved by Box2D. Lengths in metres outside; inside Box2D, one
/// robot radius is 0.1 units in every profile, because the solver's tolerances are fixed in units:
/// so it sees a contact coming that is 0.18 radii away, as far as two robots come nearer within a
/// step.
#ifndef KILOTWIN_ENGINE_WORLD_H
#define KILOTWIN_ENGINE_WORLD_H

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/arena.h"
#include "engine/chassis.h"
#include "engine/encounter.h"
#include "engine/memory.h"
#include "engine/motion.h"

namespace kilotwin {

/// A robot of World::robots() when a step begins.
struct Near {
    /// What it may touch within the step.
    enum class Company : uint8_t { NOTHING, WALL, ROBOT, SEVERAL };

    Pose pose;
    Shift free;        ///< where it would go within the step, were it alone
    Shift moved = {};  ///< where it went, after World::step()
    Company company = Company::SEVERAL;
    uint32_t other = 0;             ///< ROBOT: which of robots(), which has this one in turn
    Eigen::Vector2d towards{1, 0};  ///< WALL, ROBOT: unit vector to it
    double gap_m = 0;               ///< and from rim to rim
};

class World {
  public:
    /// `drive_m_s`: the speed of the fastest drive; `fastest_m_s`: nobody is pushed faster.
    World(const Arena &arena, const Profile &profile, double drive_m_s, double fastest_m_s,
          size_t robots);
    ~World();

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

    /// The solver sees those that are nearer than this when a step begins.
    static double margin_m(double radius_m);

    /// Solves one step of `step_s`. `near`: each of robots(), in their order. `approach_m`: the most
    /// that any two come nearer who are farther apart than margin_m(). `overlap`: the worst of the
    /// last step, as a share of a diameter; the more, the more care is taken.
    void step(std::vector<Near> &near, double step_s, double approach_m, double overlap);

  private:
    struct Box2D;
    bool firm(const Near &near) const;
    void drive(uint32_t robot, Near &near, double step_s);
    void meet(std::vector<Near> &near, size_t i, double step_s);
    void solve(std::vector<Near> &near, double step_s, double approach_m, double overlap);
    std::unique_ptr<Box2D> box2d_;
    std::vector<Driven> driven_;
    std::vector<bool> held_;
    std::vector<uint32_t> robots_;
    Encounter encounter_;
    bool added_ = false, removed_ = false;  ///< since settle()
};

/// Version of the Box2D library linked, "3.1.1".
std::string box2d_version();

}  // namespace kilotwin

#endif
