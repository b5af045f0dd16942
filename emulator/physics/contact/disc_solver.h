/// Our own solver: discs of one mass, and of all pairs only those that may touch.
///
/// A tick at a time, as in encounter.h: a limited force drives each robot, those who touch do not
/// come nearer, friction acts across the line between them, and those that overlap part. A contact
/// begins with the impulse that it had in the last tick; all are gone through a fixed number of
/// times, and each is given what it still lacks. Islands, which are robots that may touch one
/// another directly or through others, are solved one after the other.
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
    DiscSolver(const Arena &arena, const Mechanics &mechanics)
        : arena_(arena),
          mechanics_(mechanics),
          force_(mechanics.change_in(TICK_S)) {}

    void solve(Crowd &crowd, double step_s) override;

  private:
    /// A wall (the first ones), or a member. Speeds of rims are in m/s, counter-clockwise.
    struct alignas(64) Disc {
        Eigen::Vector2d at{0, 0}, velocity{0, 0};
        double rim = 0, rim_way = 0;  ///< its speed, and how far it went
        double yields = 0;            ///< 1; 0 if nothing moves it
        uint32_t pushed_at = 0;       ///< by the count of pushes_
        uint32_t member = 0;

        Shift speed(double radius_m) const { return {velocity, rim / radius_m}; }
    };

    /// A member, and what it may touch in this step. Impulses are over the mass.
    struct alignas(64) Contact {
        uint32_t one, other;            ///< discs; only the other may be a wall
        double wall_m = 0;              ///< how far a wall is from the arena's centre
        Eigen::Vector2d towards{1, 0};  ///< unit vector from one to the other
        double along = 0, across = 0;   ///< impulses in this tick; before it is solved, in the last
        double free_m_s = 0;            ///< so fast they may come nearer in this tick
        uint32_t seen_at = 0;           ///< by the count of pushes_
    };

    /// Who touches whom: robots, or a robot and a wall.
    struct Name {
        uint32_t robot, mate;
        auto operator<=>(const Name &) const = default;
    };
    /// The impulses of a contact in the last tick of a step.
    struct Kept {
        Name name;
        double along, across;
    };

    /// A part of discs_ and contacts_: those that may touch one another, directly or through
    /// others.
    struct Island {
        uint32_t first_disc, first_contact;
        uint32_t discs = 0, contacts = 0;  ///< how many
    };

    void find_islands(const Crowd &crowd);
    void place_discs(const Crowd &crowd);
    void list_contacts(const Crowd &crowd, double step_s);
    void recall();
    void place_contacts();
    void keep();
    void solve(const Island &island, const Crowd &crowd, double step_s);
    std::span<Disc> discs_of(const Island &island) {
        return {discs_.data() + island.first_disc, island.discs};
    }
    void drive(const Island &island, const Crowd &crowd, int tick, double step_s);
    void find_touches(const Island &island);
    double approach(Contact &contact) const;
    double gap_m(const Contact &contact) const;
    void part(const Contact &contact);
    void part_tight();
    void settle_all();
    bool settle(Contact &contact);
    void push(const Contact &contact, double along, double across);
    void move(const Island &island);

    const Arena &arena_;
    const Mechanics mechanics_;
    const Mechanics::Change force_;  ///< in a tick

    // Of each member.
    std::vector<uint32_t> island_;
    std::vector<uint32_t> disc_of_;
    std::vector<uint32_t> with_;  ///< one of its island, or itself, while islands are sought

    std::vector<Contact> listed_;  ///< ascending by name
    std::vector<Name> names_;
    std::vector<Kept> kept_;  ///< ascending by name

    std::vector<Island> islands_;
    std::vector<Disc> discs_;           ///< the walls, and then the members by island
    std::vector<Contact> contacts_;     ///< by island
    std::vector<uint32_t> contact_of_;  ///< of each that is listed
    std::vector<uint32_t> touches_;     ///< contacts that may matter in this tick
    std::vector<uint32_t> tight_;       ///< those of them that overlap
    uint32_t pushes_ = 0;               ///< in this tick
};

}  // namespace kilotwin

#endif
