/// Start poses: uniform in the arena, no two robots overlapping.
#ifndef KILOTWIN_PHYSICS_PLACEMENT_H
#define KILOTWIN_PHYSICS_PLACEMENT_H

#include <vector>

#include "base/chance.h"
#include "physics/arena.h"
#include "physics/motion.h"
#include "physics/objects.h"

namespace kilotwin {

/// Appends the start poses of `count` robots of one radius to `poses`. They overlap neither one
/// another, nor the robots already there, nor `objects`, nor walls and obstacles. Positions are
/// uniform in what the arena has free (tries that do not fit are drawn again), headings uniform.
/// Each robot draws by its own index, so that a further robot moves no other. Throws EngineError if
/// a robot finds no place in 20,000 tries.
void place_uniformly(std::vector<Pose> &poses, size_t count, const Arena &arena, double radius_m,
                     const Chance &chance, const std::vector<PlacedObject> &objects = {});

/// Where objects begin: as they say, or uniform in what the arena has free, turned at random, clear
/// of walls, of `robots` and of the other objects' circles. EngineError if one finds no place in
/// 20,000 tries.
std::vector<PlacedObject> place_objects(const std::vector<ObjectDef> &objects,
                                        const std::vector<Pose> &robots, const Arena &arena,
                                        double radius_m, const Chance &chance);

}  // namespace kilotwin

#endif
