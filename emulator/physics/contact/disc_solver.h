/// A contact solver for discs of one mass and radius: sequential impulses, as Box2D has them, for
/// the one case that this emulator needs.
///
/// It goes tick by tick whatever the world step. In each tick, island by island: drives accelerate
/// the discs, contacts that may close are found and start from the last tick's impulses (warm
/// starting), overlapping discs are moved apart, velocities are solved in a fixed number of rounds
/// with Coulomb friction, and positions are integrated. Cost: linear in bodies and contacts.
/// Nothing is allocated once the lists have grown.
#ifndef KILOTWIN_PHYSICS_CONTACT_DISC_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_DISC_SOLVER_H

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/clock.h"
#include "physics/arena.h"
#include "physics/contact/contact_solver.h"

namespace kilotwin {

class DiscSolver final : public ContactSolver {
  public:
    /// `arena` must outlive this.
    DiscSolver(const Arena &arena, const Mechanics &mechanics)
        : arena_(arena),
          mechanics_(mechanics),
          force_(mechanics.change_in(TICK_S)) {}

    /// Contacts that were there in the last call start from its impulses.
    void solve(Islands &islands, double step_s) override;

  private:
    /// All walls (the first disc), or a body.
    struct alignas(64) Disc {
        Eigen::Vector2d at{0, 0}, velocity{0, 0};  ///< m, m/s
        double rim = 0;                            ///< speed of the rim, m/s, counter-clockwise
        double rim_way = 0;       ///< how far the rim turned since the step began, m
        double inverse_mass = 0;  ///< 1; 0 for what does not move
        uint32_t changed_at = 0;  ///< count of changes_ when its velocity last changed
        uint32_t body = 0;        ///< its position in Islands::bodies

        Shift speed(double radius_m) const { return {velocity, rim / radius_m}; }
    };

    /// A body and what it may touch in this step. Impulses are over the mass, m/s.
    struct alignas(64) Contact {
        uint32_t one, other;           ///< discs; only `other` may be a wall
        double wall_m = 0;             ///< of a wall: its distance from the arena's centre
        Eigen::Vector2d normal{1, 0};  ///< unit vector from one to the other
        double normal_impulse = 0;     ///< in this tick; the last tick's until it is solved
        double tangent_impulse = 0;    ///< the same across the normal, by friction
        double closing_limit_m_s = 0;  ///< closing speed at which the gap is 0 after this tick
        uint32_t solved_at = 0;        ///< count of changes_ when it was last solved
    };

    /// Identifies a contact from step to step: two robots, or a robot and a wall.
    struct ContactKey {
        uint32_t robot, other;
        auto operator<=>(const ContactKey &) const = default;
    };
    /// Impulses of a contact in the last tick of a step.
    struct StoredImpulse {
        ContactKey key;
        double normal, tangent;
    };

    /// A range of discs_ and one of contacts_: bodies that may touch, directly or through others.
    struct Island {
        uint32_t first_disc, first_contact;
        uint32_t discs = 0, contacts = 0;  ///< how many
    };

    // Once a step, in this order; store_impulses() last.
    void find_islands(const Islands &islands);
    void place_discs(const Islands &islands);
    void list_contacts(const Islands &islands, double step_s);
    void list_walls(const Islands::Body &body, uint32_t disc, double step_s);
    void warm_start();
    void place_contacts();
    void store_impulses();

    // Once a tick and island, in this order.
    void solve(const Island &island, const Islands &islands, double step_s);
    void drive(const Island &island, const Islands &islands, int tick, double step_s);
    void find_active(const Island &island);
    void separate_overlapping();
    void solve_velocities();
    void integrate(const Island &island);

    std::span<Disc> discs_of(const Island &island) {
        return {discs_.data() + island.first_disc, island.discs};
    }
    double find_gap(Contact &contact) const;
    double gap_m(const Contact &contact) const;
    void separate(const Contact &contact);
    bool solve_contact(Contact &contact);
    void push(const Contact &contact, double normal_impulse, double tangent_impulse);

    const Arena &arena_;
    const Mechanics mechanics_;
    const Mechanics::Change force_;  ///< of a tick

    // By body.
    std::vector<uint32_t> island_;
    std::vector<uint32_t> disc_of_;
    std::vector<uint32_t> parent_;  ///< union-find: another body of its island, or itself

    std::vector<Contact> listed_;        ///< ascending by key
    std::vector<ContactKey> keys_;       ///< of listed_
    std::vector<StoredImpulse> stored_;  ///< of the last step, ascending by key

    std::vector<Island> islands_;
    std::vector<Disc> discs_;            ///< the walls, then the bodies by island
    std::vector<Contact> contacts_;      ///< by island
    std::vector<uint32_t> contact_of_;   ///< where listed_[i] is in contacts_
    std::vector<uint32_t> active_;       ///< contacts that may close in this tick
    std::vector<uint32_t> overlapping_;  ///< those of active_ that overlap
    uint32_t changes_ = 0;               ///< changes of velocities in this tick
};

}  // namespace kilotwin

#endif
