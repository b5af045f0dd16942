/// Moves the robots near a contact, by the cheapest method that is exact for each: alone, or alone
/// at a wall, or in pairs in closed form (closed_form.h); islands of three and more by a solver
/// (island_solver.h). Lengths in metres.
///
/// Bodies decides which robots are near a contact (the broad phase) and calls, in each world step:
/// add() and remove(), then step().
#ifndef KILOTWIN_PHYSICS_CONTACT_CONTACTS_H
#define KILOTWIN_PHYSICS_CONTACT_CONTACTS_H

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/prefetch.h"
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

    /// Prefetches what step() needs of a robot.
    void prefetch(uint32_t robot) const { prefetch_line(&driven_[robot]); }

    /// Whether a robot is held here: added, and not removed.
    bool holds(uint32_t robot) const { return held_[robot]; }

    /// Takes a robot in that is not held, with the velocity that it has at `at`. Members of a team
    /// may add and remove different robots at once.
    void add(uint32_t robot, const Trajectory &trajectory, Cycles at);
    /// Lets a held robot go.
    void remove(uint32_t robot) { held_[robot] = false; }

    /// Lets a robot go that is elsewhere now, if it is held.
    void forget(uint32_t robot);

    /// Moves all robots held for `step_s`. `crowd` has a body for each of them, with `kind` as
    /// Grouping::choose() wants it; `objects`: those that bodies of the kind ISLAND may touch, or
    /// that move.
    void step(Crowd &crowd, const std::vector<Islands::PushedObject> &objects, double step_s);

    /// Robots that the solver moved, times steps, so far.
    uint64_t island_steps() const { return island_steps_; }

  private:
    /// Of one share.
    struct alignas(64) Before {
        std::vector<DrivenBody> driven;  ///< of uncertain bodies, before they moved in this step
    };

    void step_in_closed_form(Crowd &crowd, uint32_t share, double step_s);
    void take_back_missed(Crowd &crowd, uint32_t share);
    void list_islands(Crowd &crowd, uint32_t share);
    void list_all_islands(Crowd &crowd);
    void add_to_islands(Islands &islands, ContactBody &body);
    void add_to_islands(Islands &islands, const std::vector<ContactBody> &bodies,
                        const ContactPair &pair);
    bool fixed(const ContactBody &body) const;
    ContactSide drive(ContactBody &body, double step_s);
    void step_alone(ContactBody &body, double step_s);
    void step_pair(ContactBody &one, ContactBody &other, double step_s);

    Team &team_;
    std::vector<DrivenBody> driven_;  ///< by robot
    std::vector<uint8_t> held_;       ///< by robot
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
