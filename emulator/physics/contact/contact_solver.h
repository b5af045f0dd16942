/// The interface of contact solvers: they move islands of three bodies and more, one world step at
/// a time. Single contacts do not come here (closed_form.h).
///
/// Implementations: disc_solver.h, the default, and box2d_solver.h. Lengths in metres.
#ifndef KILOTWIN_PHYSICS_CONTACT_CONTACT_SOLVER_H
#define KILOTWIN_PHYSICS_CONTACT_CONTACT_SOLVER_H

#include <cstdint>
#include <vector>

#include "physics/contact/mechanics.h"
#include "physics/motion.h"
#include "physics/objects.h"

namespace kilotwin {

/// BOX2D_ORACLE is for tests: many times slower, and as exact as Box2D can be.
enum class SolverKind : uint8_t { BOX2D, BOX2D_ORACLE, DISCS };

/// All islands of one step: bodies that may touch several others, or a wall besides.
struct Islands {
    struct Body {
        uint32_t robot;     ///< index
        bool fixed;         ///< at rest, and does not give way
        bool at_wall;       ///< may touch a wall within the step
        const Pose &pose;   ///< when the step begins
        const Shift &free;  ///< displacement in this step if nothing touched it
        DrivenBody &driven;
        Shift &moved;  ///< out: displacement in this step
    };
    /// Two bodies that may touch within the step, by their positions in a list; one < other.
    struct Pair {
        uint32_t one, other;
    };
    /// An object that something may touch within the step, or that moves.
    struct PushedObject {
        uint32_t object;     ///< index
        ObjectState &state;  ///< in: when the step begins; out: when it ends
    };
    std::vector<Body> bodies;           ///< ascending by robot
    std::vector<Pair> pairs;            ///< of `bodies`, ascending
    std::vector<PushedObject> objects;  ///< ascending by object
};

class ContactSolver {
  public:
    virtual ~ContactSolver() = default;

    /// Moves all bodies for `step_s`, a whole number of ticks: sets `moved` and the velocities.
    /// Called once a world step by Contacts, also without bodies: a solver may keep what it knows
    /// of a body only as long as that body is in each call. Deterministic: equal input, in equal
    /// order, gives equal bits.
    virtual void solve(Islands &islands, double step_s) = 0;

    /// A robot is elsewhere now: what is known of it does not hold.
    virtual void forget(uint32_t /*robot*/) {}
};

}  // namespace kilotwin

#endif
