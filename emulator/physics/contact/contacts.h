/// Moves the robots near a contact, by the cheapest method that is exact for each: alone, or alone
/// at a wall, or in pairs in closed form (closed_form.h); islands of three and more by a solver
/// (island_solver.h). Lengths in metres.
///
/// Bodies decides which robots are near a contact (the broad phase), and calls step() in each world
/// step.
#ifndef KILOTWIN_PHYSICS_CONTACT_CONTACTS_H
#define KILOTWIN_PHYSICS_CONTACT_CONTACTS_H

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "physics/arena.h"
#include "physics/chassis.h"
#include "physics/contact/box2d_solver.h"
#include "physics/contact/closed_form.h"
#include "physics/contact/grouping.h"
#include "physics/contact/island_solver.h"
#include "physics/motion.h"

namespace kilotwin {

class Contacts {
  public:
    /// `drive_m_s`: speed of the fastest drive; `fastest_m_s`: limit for pushed robots; `robots`:
    /// their number. `arena` and `team` must outlive this. Any accuracy but NORMAL is Box2D's.
    Contacts(const Arena &arena, const Profile &profile, Team &team, double drive_m_s,
             double fastest_m_s, size_t robots, const std::vector<Object> &objects = {},
             Box2DSolver::Accuracy accuracy = Box2DSolver::Accuracy::NORMAL);

    /// How a robot is driven that comes near a contact: as it goes then.
    static DrivenBody driven_as(double heading, const Drive &drive);

    /// Drops what is known of a robot that is elsewhere now.
    void forget(uint32_t robot) { solver_->forget(robot); }

    /// Moves all robots of a crowd for `step_s`. On entry the `kind` of bodies is as
    /// Grouping::choose() wants it; `objects`: those that bodies of the kind ISLAND may touch, or
    /// that move.
    void step(Crowd &crowd, const std::vector<Islands::PushedObject> &objects, double step_s);

    /// Robots that the solver moved, times steps, so far.
    uint64_t island_steps() const { return island_steps_; }

  private:
    /// Robots of one share as they were driven.
    struct alignas(64) Before {
        std::vector<DrivenBody> driven;  ///< of uncertain bodies, before they moved in this step
    };

    void step_in_closed_form(Crowd &crowd, uint32_t share, double step_s);
    void take_back_missed(Crowd &crowd, uint32_t share);
    void list_islands(Crowd &crowd, uint32_t share);
    void list_all_islands(Crowd &crowd);
    void add_to_islands(Islands &islands, Crowd &crowd, uint32_t i) const;
    static void add_to_islands(Islands &islands, const Crowd &crowd, const ContactPair &pair);
    bool fixed(const ContactBody &body) const;
    ContactSide drive(Crowd &crowd, uint32_t i, double step_s) const;
    void step_alone(Crowd &crowd, uint32_t i, double step_s) const;
    void step_pair(Crowd &crowd, uint32_t i, uint32_t k, double step_s) const;

    Team &team_;
    bool gives_way_;
    ClosedForm closed_form_;
    Grouping grouping_;
    Mechanics::Change force_{};   ///< of this step
    std::vector<Before> before_;  ///< by share
    std::unique_ptr<IslandSolver> solver_;
    std::vector<Islands> islands_;  ///< by share
    uint64_t island_steps_ = 0;
};

}  // namespace kilotwin

#endif
