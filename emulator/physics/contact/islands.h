/// Islands: groups of bodies that may touch several others within a world step, or a wall besides.
/// A solver moves them (island_solver.h); single contacts have a closed form (closed_form.h).
/// Lengths in metres.
#ifndef KILOTWIN_PHYSICS_CONTACT_ISLANDS_H
#define KILOTWIN_PHYSICS_CONTACT_ISLANDS_H

#include <cstdint>
#include <vector>

#include "physics/contact/mechanics.h"
#include "physics/motion.h"
#include "physics/objects.h"

namespace kilotwin {

/// Islands of one step: all, or those of a share of a team (grouping.h).
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

}  // namespace kilotwin

#endif
