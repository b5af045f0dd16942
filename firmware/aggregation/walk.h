/// How the robot moves about: straight legs, random turns, and turns away from what is in its way.
///
/// Decides, never acts: the caller passes in time, floor and random numbers, and drives the motors
/// as `motion` says. All arithmetic is in integers and gives the same on every machine.
#ifndef AGGREGATION_WALK_H
#define AGGREGATION_WALK_H

#include <stdbool.h>
#include <stdint.h>

#include "params.h"
#include "random.h"

typedef enum { WALK_STOP, WALK_STRAIGHT, WALK_LEFT, WALK_RIGHT } walk_motion_t;

/// The caller owns it. `motion` and `avoiding` are for reading.
typedef struct {
    uint32_t leg_end;           ///< when the straight leg is over; turns away from things delay it
    uint32_t turn_end;          ///< when the turn is over
    uint32_t wall_heeded_from;  ///< before that the warning of a wall cell is ignored
    uint8_t motion;             ///< a walk_motion_t
    bool avoiding;              ///< turning away from an obstacle or a wall, not at random
} walk_t;

/// At rest. Wall cells are heeded from `now` on.
void walk_init(walk_t *walk, uint32_t now);

/// Stops, whatever was going on.
void walk_stop(walk_t *walk);

/// Straight on from `now`, a fresh leg of STRAIGHT_TICKS; a turn under way is broken off.
void walk_straight(walk_t *walk, const params_t *params, uint32_t now);

/// Whether a robot on a floor with these WIRE_CELL_ flags must not go straight on: an obstacle is
/// ahead, or it stands on a wall cell whose warning is heeded.
bool walk_blocked(const walk_t *walk, uint32_t now, uint8_t flags);

/// One step of a walk that is not stopped. Call it once a tick, or as walk_wake() says.
///
/// On a straight leg: if the way is blocked the robot stops and turns by a uniform angle, and
/// again for as long as an obstacle is ahead; then it resumes the leg, which the turn has not
/// shortened. Turning away from a wall cell is done once, after which its warning is ignored for
/// WALL_IGNORE_TICKS. If `legs`, a leg that is over ends in a turn by a wrapped Cauchy angle and
/// a new leg follows; otherwise the robot goes straight for ever. Nothing interrupts a turn.
///
/// Returns the length in ticks of the turn away from something that began in this step, else 0.
uint32_t walk_step(walk_t *walk, const params_t *params, random_t *random, uint32_t now,
                   uint8_t flags, bool legs);

/// Until this tick walk_step() changes nothing, as long as flags and `legs` stay what they are.
uint32_t walk_wake(const walk_t *walk, uint32_t now, uint8_t flags, bool legs);

/// Angles are in units of pi / 32,768 (0.0055 degrees), positive to the left (counter-clockwise).

/// Uniform over [-pi, pi): the upper half of a uniform 32-bit `draw`.
int16_t walk_angle_uniform(uint32_t draw);

/// Wrapped Cauchy around 0, with concentration `rho` in Q16 (0 is uniform): the inverse of its
/// cumulative distribution, 2 atan((1 - rho) / (1 + rho) tan(pi (u - 1/2))), at the u that `draw`
/// says with 17 bits. For rho up to 0.99 the angle is within 0.1 degrees of the exact one.
int16_t walk_angle_cauchy(uint32_t draw, uint16_t rho);

/// How long a turn by `angle` takes, rounded to the nearest tick; `ticks_per_rad` is Q16.
uint32_t walk_turn_ticks(int16_t angle, uint32_t ticks_per_rad);

#endif
