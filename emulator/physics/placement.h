/// Start poses: uniform in the arena, no two robots overlapping.
#ifndef KILOTWIN_PHYSICS_PLACEMENT_H
#define KILOTWIN_PHYSICS_PLACEMENT_H

#include <vector>

#include "base/chance.h"
#include "physics/arena.h"
#include "physics/motion.h"

namespace kilotwin {

/// Adds `count` robots of one radius to `poses`, free of one another, of those already there and of
/// the walls. Each robot draws for itself, so a further robot changes nobody else's place. Throws
/// EngineError when they do not fit.
void place_uniformly(std::vector<Pose> &poses, size_t count, const Arena &arena, double radius_m,
                     const Chance &chance);

}  // namespace kilotwin

#endif
