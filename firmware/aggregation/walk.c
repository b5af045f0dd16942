#include "walk.h"

#include "ticks.h"
#include "wire.h"

// Farther off than any deadline, and near enough to compare.
#define NEVER_TICKS UINT32_C(0x40000000)

void walk_init(walk_t *walk, uint32_t now) {
    *walk = (walk_t){.motion = WALK_STOP, .turn_end = now, .wall_heeded_from = now};
}

void walk_stop(walk_t *walk) {
    walk->motion = WALK_STOP;
    walk->avoiding = false;
}

void walk_straight(walk_t *walk, const params_t *params, uint32_t now) {
    walk->motion = WALK_STRAIGHT;
    walk->avoiding = false;
    walk->leg_end = now + params->STRAIGHT_TICKS;
}

static bool wall_warns(const walk_t *walk, uint32_t now, uint8_t flags) {
    return (flags & WIRE_CELL_WALL) && ticks_reached(now, walk->wall_heeded_from);
}

bool walk_blocked(const walk_t *walk, uint32_t now, uint8_t flags) {
    return (flags & WIRE_CELL_OBSTACLE) || wall_warns(walk, now, flags);
}

// A turn too small to last a tick leaves the motion as it is.
static uint32_t turn(walk_t *walk, int16_t angle, const params_t *params) {
    const uint32_t ticks = walk_turn_ticks(angle, params->TURN_TICKS_PER_RAD);
    if (ticks > 0) walk->motion = angle < 0 ? WALK_RIGHT : WALK_LEFT;
    return ticks;
}

static uint32_t turn_away(walk_t *walk, const params_t *params, random_t *random, uint32_t now,
                          uint8_t flags) {
    // A robot on a wall cell is warned until it is off the cell, which one turn cannot bring about.
    const bool from_wall = wall_warns(walk, now, flags);
    walk->motion = WALK_STOP;
    walk->avoiding = true;
    uint32_t ticks = turn(walk, walk_angle_uniform(random_next(random)), params);
    if (ticks == 0) ticks = 1;
    walk->turn_end = now + ticks;
    walk->leg_end += ticks;
    if (from_wall) walk->wall_heeded_from = walk->turn_end + params->WALL_IGNORE_TICKS;
    return ticks;
}

static void turn_at_random(walk_t *walk, const params_t *params, random_t *random, uint32_t now) {
    const int16_t angle = walk_angle_cauchy(random_next(random), params->RHO);
    walk->turn_end = now + turn(walk, angle, params);
    walk->leg_end = walk->turn_end + params->STRAIGHT_TICKS;
}

uint32_t walk_step(walk_t *walk, const params_t *params, random_t *random, uint32_t now,
                   uint8_t flags, bool legs) {
    if (walk->motion != WALK_STRAIGHT && !ticks_reached(now, walk->turn_end)) return 0;
    // A turn is over, or there was none. A leg that is over has to wait until the way is free.
    if (walk_blocked(walk, now, flags)) return turn_away(walk, params, random, now, flags);

    walk->motion = WALK_STRAIGHT;
    walk->avoiding = false;
    if (legs && ticks_reached(now, walk->leg_end)) turn_at_random(walk, params, random, now);
    return 0;
}

uint32_t walk_wake(const walk_t *walk, uint32_t now, uint8_t flags, bool legs) {
    if (walk->motion != WALK_STRAIGHT) return walk->turn_end;
    uint32_t wake = now + NEVER_TICKS;
    if (legs) wake = walk->leg_end;
    if (flags & WIRE_CELL_WALL) wake = ticks_earlier(wake, walk->wall_heeded_from);
    return wake;
}

int16_t walk_angle_uniform(uint32_t draw) { return (int16_t)(uint16_t)(draw >> 16); }

// tan(i / 32 pi / 4) in Q15.
static const uint16_t TANGENT[33] = {
    0,     804,   1610,  2417,  3227,  4042,  4861,  5686,  6518,  7358,  8208,
    9068,  9940,  10825, 11725, 12640, 13573, 14525, 15498, 16494, 17515, 18563,
    19640, 20750, 21895, 23078, 24302, 25572, 26892, 28266, 29699, 31198, 32768,
};

// tan(x) in Q26, for x = (angle + 1/2) / 32,768 pi / 4 with angle below 32,768.
static uint32_t tangent(uint16_t angle) {
    const uint8_t i = (uint8_t)(angle >> 10);
    const uint16_t part = (uint16_t)((angle & 1023) * 2 + 1);
    const uint16_t step = (uint16_t)(TANGENT[i + 1] - TANGENT[i]);
    return ((uint32_t)TANGENT[i] << 11) + (uint32_t)step * part;
}

// The inverse: 32,768 atan(ratio) / (pi / 4), for a ratio up to one in Q15. The same table, read
// the other way round.
static uint16_t arc_tangent(uint16_t ratio) {
    uint8_t i = 0;
    while (i < 31 && TANGENT[i + 1] <= ratio) i++;
    const uint16_t step = (uint16_t)(TANGENT[i + 1] - TANGENT[i]);
    const uint32_t part = ((uint32_t)(ratio - TANGENT[i]) << 10) / step;
    return (uint16_t)(((uint32_t)i << 10) + part);
}

int16_t walk_angle_cauchy(uint32_t draw, uint16_t rho) {
    // |pi (u - 1/2)| is x + 1/2 units of pi / 131,072. Beyond pi / 4, tan(x) = 1 / tan(pi / 2 - x).
    const uint16_t x = (uint16_t)(draw >> 16);
    const bool steep = x > 32767;
    const uint32_t tan_x = tangent(steep ? (uint16_t)(65535u - x) : x);

    // rise / run = (1 - rho) / (1 + rho) tan(x), with 26 bits after the point.
    const uint64_t less = UINT32_C(65536) - rho;
    const uint64_t more = UINT32_C(65536) + rho;
    const uint64_t rise = steep ? less << 26 : less * tan_x;
    const uint64_t run = steep ? more * tan_x : more << 26;

    const uint16_t half = rise > run
                              ? (uint16_t)(65535u - arc_tangent((uint16_t)((run << 15) / rise)))
                              : arc_tangent((uint16_t)((rise << 15) / run));
    const int16_t magnitude = (int16_t)(half >> 1);
    if (draw & 1) return (int16_t)-magnitude;
    return magnitude;
}

#define PI_Q13 25736  // with angle and rate, 63 bits in all

uint32_t walk_turn_ticks(int16_t angle, uint32_t ticks_per_rad) {
    const uint32_t magnitude = (uint32_t)(angle < 0 ? -(int32_t)angle : angle);
    const uint64_t ticks_q44 = (uint64_t)magnitude * PI_Q13 * ticks_per_rad;
    return (uint32_t)((ticks_q44 + ((uint64_t)1 << 43)) >> 44);
}
