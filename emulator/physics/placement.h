/// Start poses: uniform in the arena, no two robots overlapping.
#ifndef KILOTWIN_PHYSICS_PLACEMENT_H
#define KILOTWIN_PHYSICS_PLACEMENT_H

#include <cstdint>
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

/// Indices of robots along a curve that goes through all small squares of the table, one quarter
/// after the other (Morton's order): robots near each other come soon after each other. In a square
/// they come by index. O(n log n).
std::vector<uint32_t> by_place(const std::vector<Pose> &poses);

}  // namespace kilotwin

#endif
