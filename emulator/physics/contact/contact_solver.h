/// Who solves a crowd: robots that may touch several others, or a wall besides, within a step.
/// Lengths in metres.
#ifndef KILOTWIN_PHYSICS_CONTACT_CONTACT_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_CONTACT_SOLVER_H

#include <cstdint>
#include <vector>

#include "physics/contact/encounter.h"
#include "physics/motion.h"

namespace kilotwin {

enum class SolverKind : uint8_t { DISCS, BOX2D };

/// All who are in a crowd in one step.
struct Crowd {
    struct Member {
        uint32_t robot;
        bool firm;          ///< it stands, and nobody moves it
        bool at_wall;       ///< it may touch one
        const Pose &pose;   ///< when the step begins
        const Shift &free;  ///< where it would go, were it alone
        Driven &driven;
        Shift &moved;  ///< where it went, after ContactSolver::solve()
    };
    /// Two that may touch, by their numbers in a list: one < other.
    struct Pair {
        uint32_t one, other;
    };
    std::vector<Member> members;  ///< ascending by robot
    std::vector<Pair> pairs;      ///< of members, ascending
};

class ContactSolver {
  public:
    virtual ~ContactSolver() = default;

    /// Moves the members of a crowd for `step_s`, a number of ticks. To be called when there are
    /// none as well: who is no member may be anywhere by the next time.
    virtual void solve(Crowd &crowd, double step_s) = 0;
};

}  // namespace kilotwin

#endif
