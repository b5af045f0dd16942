/// Which contact each robot near one has, and which robots need a solver. Lengths in metres.
///
/// Bodies that may touch within a step form groups. If no body of a group touches two things, each
/// of its contacts is in closed form; what a body is near but does not touch is looked at when the
/// step is done, and if it was touched after all, the group goes to the solver.
#ifndef KILOTWIN_PHYSICS_CONTACT_GROUPING_H
#define KILOTWIN_PHYSICS_CONTACT_GROUPING_H

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/team.h"
#include "physics/arena.h"
#include "physics/contact/mechanics.h"
#include "physics/motion.h"

namespace kilotwin {

/// A robot near a contact, for one step. Those of a step are ascending by robot.
struct ContactBody {
    /// The contact that it has. ISLAND: several, or one with an object; set by the caller, or by
    /// Grouping.
    enum class Kind : uint8_t { NONE, WALL, ROBOT, ISLAND };

    Pose pose;         ///< when the step begins
    Shift free;        ///< displacement in this step if nothing touched it
    Shift moved = {};  ///< out: displacement in this step
    Kind kind = Kind::ISLAND;
    bool at_wall = false;          ///< may touch a wall within the step
    bool touches = false;          ///< NONE, WALL, ROBOT: touches it, as far as is known
    bool uncertain = false;        ///< may touch something else; set by Grouping::choose()
    uint32_t robot = 0;            ///< index
    uint32_t other = 0;            ///< ROBOT: position of the other one in the list
    uint32_t member = 0;           ///< ISLAND: position in Islands::bodies
    Eigen::Vector2d normal{1, 0};  ///< WALL, ROBOT: unit vector towards it
    double gap_m = 0;              ///< WALL, ROBOT: from rim to rim; below 0 an overlap

    /// Whether two bodies at `gap` touch or come to touch within the step, if nothing else is in
    /// the way: `closing` is the difference of their free displacements, `normal` the direction
    /// from the one to the other. Nearly touching counts: robots that are pressed together drift
    /// apart by little now and then.
    static bool meets(double gap, const Eigen::Vector2d &normal, const Eigen::Vector2d &closing,
                      double radius_m) {
        return gap <= std::max(NEARLY * radius_m, closing.dot(normal));
    }
    static constexpr double NEARLY = 0.02;
};

/// Two bodies that may touch within the step, by their positions in the list; one < other.
struct ContactPair {
    uint32_t one, other;
    double distance_m;  ///< of their centres, when the step begins
};

/// All robots near a contact in a step, and which of them may touch each other, by shares of a
/// team.
struct Crowd {
    struct Share {
        uint32_t begin = 0, end = 0;     ///< positions of its bodies
        std::vector<ContactPair> pairs;  ///< those of which `one` is among its bodies; ascending
    };
    std::vector<ContactBody> bodies;  ///< ascending by robot
    std::vector<DrivenBody> driven;   ///< by body: how it was driven in the last step, then in this
    std::vector<Share> shares;        ///< as many as the team has members; together they are all
};

/// A group belongs to the share of its first body, also where others of it are of later shares: a
/// member does all of it. So what comes out does not depend on how many shares there are.
class Grouping {
  public:
    /// For robots of `radius_m` in `arena`. Both `arena` and `team` must outlive this.
    Grouping(const Arena &arena, double radius_m, Team &team);

    /// Finds the groups of a step, for the calls that follow. O(bodies + pairs), by all members.
    void find_groups(const Crowd &crowd);

    // Members call these for the groups of their own share.

    /// Sets `kind` and what belongs to it, and `uncertain`. On entry `kind` is NONE, WALL with
    /// `touches`, normal and gap, or ISLAND; it stays ISLAND for all of such a body's group.
    /// O(bodies + pairs).
    void choose(Crowd &crowd, uint32_t share);

    /// After all bodies but those in islands moved: makes groups islands of which a body would
    /// overlap something that is not its contact, or a wall by more than it did before. Returns
    /// whether there were any; undo their moves.
    bool find_missed(Crowd &crowd, uint32_t share);

    /// Calls `visit(position)` for each body of a share's groups, ascending.
    template <typename Visit>
    void for_each_body(const Crowd &crowd, uint32_t share, Visit visit) const {
        const auto &[begin, end, pairs] = crowd.shares[share];
        for (uint32_t i = begin; i < end; i++)
            if (groups_[i] >= begin) visit(i);
        for (size_t later = share + 1; later < crowd.shares.size(); later++)
            for (const uint32_t i : strays_[later].bodies)
                if (groups_[i] >= begin && groups_[i] < end) visit(i);
    }
    /// Calls `visit(pair)` for each pair of them, ascending.
    template <typename Visit>
    void for_each_pair(const Crowd &crowd, uint32_t share, Visit visit) const {
        const auto &[begin, end, pairs] = crowd.shares[share];
        for (const ContactPair &pair : pairs)
            if (groups_[pair.one] >= begin) visit(pair);
        for (size_t later = share + 1; later < crowd.shares.size(); later++)
            for (const ContactPair &pair : strays_[later].pairs)
                if (groups_[pair.one] >= begin && groups_[pair.one] < end) visit(pair);
    }

  private:
    /// Bodies and pairs of a share that are of an earlier one's groups.
    struct alignas(64) Strays {
        std::vector<uint32_t> bodies;
        std::vector<ContactPair> pairs;
        std::vector<ContactPair> across;  ///< `other` is of a later share
    };

    uint32_t group_of(uint32_t body);
    void join_groups(uint32_t one, uint32_t other);
    void join_own(const Crowd &crowd, uint32_t share);
    void find_strays(const Crowd &crowd, uint32_t share);
    void join(Crowd &crowd, const ContactPair &pair, const Eigen::Vector2d &normal) const;

    const Arena &arena_;
    double radius_m_;
    Team &team_;
    std::vector<uint32_t> parents_;  ///< by body: of its group's tree, whose root is its first body
    std::vector<uint32_t> groups_;   ///< by body: its group's first one
    std::vector<uint8_t> islands_;   ///< by body, of first ones: whether the group is an island
    std::vector<uint8_t> uncertain_;  ///< by body, of first ones: whether one is near something
    std::vector<Strays> strays_;      ///< by share
};

}  // namespace kilotwin

#endif
