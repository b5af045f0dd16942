/// The solver of islands without objects: discs of one size, and walls. It is the method of Box2D,
/// which is its plain twin and its oracle (box2d_solver.h): soft contacts, one iteration and one
/// relaxation in each sub-step [1]. It needs no tree of boxes, no shapes and no islands of its own,
/// since pairs come with the islands: `dense` has 1.36 times the rate (docs/performance.md).
///
/// [1] E. Catto, "Solver2D", 2024, box2d.org: the soft step.
#ifndef KILOTWIN_PHYSICS_CONTACT_DISC_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_DISC_SOLVER_H

#include <cstdint>
#include <vector>

#include "base/team.h"
#include "physics/contact/island_solver.h"

namespace kilotwin {

class DiscSolver final : public IslandSolver {
  public:
    /// `arena` and `team` must live on.
    DiscSolver(const Arena &arena, const Mechanics &mechanics, Team &team)
        : IslandSolver(arena, mechanics),
          team_(team),
          shares_(team.size()) {}

    /// Islands have no objects. Time in proportion to bodies and pairs, times sub-steps; each
    /// member does its share of them.
    void solve(std::vector<Islands> &islands, double step_s) override;
    bool solves_by_shares() const override { return true; }
    void forget(uint32_t robot) override;

  private:
    /// A robot of mass 1. Its turning is the way, or the speed, of its rim.
    struct alignas(64) Disc {
        Eigen::Vector2d velocity, way;  ///< `way`: so far in this step
        double spin, rim_way;
        double mobility;  ///< 1 over its mass; 0 if nothing moves it
    };
    /// How a drive brings the velocity to what is wanted: shares of what is missing, for each
    /// sub-step.
    struct Drive {
        Eigen::Vector2d wanted;
        double spin, share, spin_share;
    };
    struct Impulses {
        double normal = 0, friction = 0;
    };
    /// How a contact that overlaps answers, as a damped spring does.
    struct Softness {
        double rate_per_s, mass_share, impulse_share;
        Softness(double hertz, double sub_step_s);
    };
    /// A contact that may come about: the first disc, and the other one or a wall.
    struct alignas(64) Contact {
        Eigen::Vector2d normal;  ///< from the first one
        double gap_m;            ///< less the way along the normal when it was found
        double mass;             ///< of both against one another
        Impulses impulses;       ///< of a sub-step
        uint32_t one, other;     ///< discs
    };
    /// A contact with a wall, before it is added.
    struct AtWall {
        uint64_t key;
        uint32_t disc;
        double gap_m;
        Eigen::Vector2d normal;
    };
    struct Kept {
        uint64_t key;  ///< of two robots, or of a robot and a wall
        Impulses impulses;
    };

    /// Islands of one share.
    struct alignas(64) Share {
        std::vector<Disc> discs;  ///< by body, and the walls
        std::vector<Drive> drives;
        std::vector<Contact> contacts;  ///< of this round
        std::vector<uint64_t> keys;     ///< of contacts, ascending
        std::vector<AtWall> at_walls;   ///< scratch of find_walls()
        std::vector<Kept> kept;         ///< of the last round, ascending by key
        Closeness closeness;

        /// The disc that is all walls.
        uint32_t walls() const { return static_cast<uint32_t>(discs.size() - 1); }
        double gap_now_m(const Contact &contact) const {
            return contact.gap_m +
                   contact.normal.dot(discs[contact.other].way - discs[contact.one].way);
        }
        /// Changes the accumulated normal impulse by no more than what keeps it from pulling.
        void push(Contact &contact, double impulse);
        void rub(Contact &contact, double impulse);

        // The parts of a sub-step.
        void drive();
        void warm_start();
        void push_apart(double sub_step_s, double part_m_s);
        void go_on(double sub_step_s, double fastest_m_s);
        void relax(double sub_step_s);
    };
    /// Impulses of the last round, and how far they are used: contacts come ascending.
    struct KeptSoFar {
        const std::vector<Kept> &kept;
        size_t next = 0;
        Impulses of(uint64_t key);
    };

    void solve_share(Share &share, Islands &islands, const Division &division, double step_s) const;
    void take_bodies(Share &share, Islands &islands, double step_s) const;
    void set_drives(Share &share, const Islands &islands, double sub_step_s) const;
    void find_contacts(Share &share, const Islands &islands, double round_s,
                       const std::vector<Kept> &kept) const;
    void find_walls(Share &share, const Islands &islands, double round_s, KeptSoFar &kept) const;
    static void add_contact(Share &share, uint32_t one, uint32_t other,
                            const Eigen::Vector2d &normal, double gap_m, uint64_t key,
                            KeptSoFar &kept);
    static void keep_impulses(Share &share);
    void give_back(const Share &share, Islands &islands) const;
    void merge_kept();

    Team &team_;
    std::vector<Share> shares_;
    std::vector<Kept> kept_;  ///< of the last step, ascending by key
};

}  // namespace kilotwin

#endif
