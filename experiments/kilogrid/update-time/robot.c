// Aggregation under informed robots, with an update time (docs/update_time.md): robots gather on a
// black and a white stripe, count who rests around them once in an update time, and leave by
// chance, the less likely the more they have counted. Written from the facts of that page.
//
// One file for the three types: INFORMED_FOR is 0, BLACK or WHITE_CELL.
#include <kilolib.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "messages.h"

#ifndef INFORMED_FOR
#define INFORMED_FOR 0
#endif
#ifndef UPDATE_S
#define UPDATE_S 2  // 0: dynamic, from 1 s on, four ticks more each minute
#endif
#ifndef DRAW_BITS
#define DRAW_BITS 8  // 8, as published, 16 or 32
#endif
#ifndef GUARDED
#define GUARDED 0  // 0, as published: each pass of loop() in the first tick of a minute adds to it
#endif
#ifndef WEIGHT
#define WEIGHT 1  // of an informed robot in the count
#endif
#ifndef TX_PERIOD
#define TX_PERIOD 3906  // of 128 us, between two messages of a robot that stays: half a second
#endif
#ifndef FLOOR
#define FLOOR 0  // 1: the virtual floor takes the place of cells
#endif
#ifndef STEP_TENTHS
#define STEP_TENTHS 0  // of ticks between two passes that act; 0: each acts. Their simulator has 31
#endif

#define S 32  // ticks of a second in all that was published; it takes 1.05 s
#define ALPHA 0.5f
#define BETA 2.25f
#define GAMMA 0.6931472f  // ln 2, of a wrapped Cauchy distribution with rho = 0.5
#define PI 3.1415927f
#define TURN_DEG_PER_S 45

#define WALK_TICKS (2 * 160)
#define ENTER_TICKS 320
#define LEFT_TICKS 160  // straight on, once off the site
#define MOST_LEAVE_TICKS (30 * S)
#define AVOID_TURN_TICKS (4 * S)
#define AVOID_TICKS 320
#define MINUTE_TICKS 1920
#define MINUTE_MORE_TICKS 4
#define MOST_NEIGHBOURS 25

typedef enum { WALK, ENTER, STAY, LEAVE, OBSTACLE } state_t;
typedef enum { STANDS, STRAIGHT, LEFT, RIGHT } motion_t;
// WALK: straight, a turn. LEAVE: on the site, beside it. OBSTACLE: a turn, straight.
typedef enum { FIRST, SECOND } part_t;

// By the last cell that was received; for metrics too, one for each colour.
static volatile bool on_black, on_white, on_wall;

// Ids that were received since the last update: the interrupt fills it, loop() empties it.
static volatile uint8_t neighbours[MOST_NEIGHBOURS], received, weights;

static volatile state_t state;
static motion_t motion;
static part_t part;
static uint32_t until;  // tick at which what it does ends
static uint32_t leaves_since;
static uint32_t updated_at;
static uint32_t update_ticks = (UPDATE_S ? UPDATE_S : 1) * S;
static message_t message;

// kilo_ticks has four bytes, and an interrupt counts it up.
static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

// A number from 0 to 1 of DRAW_BITS bits; both ends can come.
static float draw(void) {
    uint32_t bits = 0;
    for (uint8_t i = 0; i < DRAW_BITS / 8; i++) bits = bits << 8 | rand_hard();
    return (float)bits / (float)(0xFFFFFFFF >> (32 - DRAW_BITS));
}

static void move(motion_t wanted) {
    if (motion == wanted) return;
    motion = wanted;
    if (wanted != STANDS) spinup_motors();  // a motor that stood needs the kick
    set_motors(wanted == STRAIGHT || wanted == LEFT ? kilo_turn_left : 0,
               wanted == STRAIGHT || wanted == RIGHT ? kilo_turn_right : 0);
}

static bool may_stay(void) {
    if (INFORMED_FOR == BLACK) return on_black;
    if (INFORMED_FOR == WHITE_CELL) return on_white;
    return on_black || on_white;
}

static void walk(uint32_t now) {
    state = WALK;
    set_color(RGB(0, 0, 0));
    part = FIRST;
    until = now + WALK_TICKS;
    move(STRAIGHT);
}

static void enter(uint32_t now) {
    state = ENTER;
    until = now + ENTER_TICKS;
    move(STRAIGHT);
}

static void stay(uint32_t now) {
    move(STANDS);
    set_color(RGB(1, 1, 1));
    received = weights = 0;
    updated_at = now;
    state = STAY;
}

static void leave(uint32_t now) {
    state = LEAVE;
    set_color(RGB(0, 1, 0));
    leaves_since = now;
    part = FIRST;
    move(STRAIGHT);
}

static void avoid(uint32_t now) {
    state = OBSTACLE;
    set_color(RGB(1, 0, 0));
    part = FIRST;
    until = now + AVOID_TURN_TICKS;
    move(LEFT);
}

// The angle of a turn in degrees, left above 0: a wrapped Cauchy distribution by inversion.
static float turn_deg(void) {
    const float angle = GAMMA * tanf(PI * draw() - PI / 2);
    float folded = fmodf(angle, 2 * PI);
    if (folded > PI) folded -= 2 * PI;
    if (folded < -PI) folded += 2 * PI;
    return folded * 180 / PI;
}

static void walk_on(uint32_t now) {
    if (on_wall) {
        avoid(now);
    } else if (may_stay()) {
        enter(now);
    } else if (now >= until) {
        part = part == FIRST ? SECOND : FIRST;
        if (part == SECOND) {
            const float angle = turn_deg();
            until = now + (uint32_t)(fabsf(angle) * S / TURN_DEG_PER_S);
            move(angle > 0 ? LEFT : RIGHT);
        } else {
            until = now + WALK_TICKS;
            move(STRAIGHT);
        }
    }
}

static void enter_on(uint32_t now) {
    if (on_wall)
        walk(now);
    else if (now >= until) {
        if (may_stay())
            stay(now);
        else
            walk(now);
    }
}

static void stay_on(uint32_t now) {
    if (INFORMED_FOR != 0 || now - updated_at < update_ticks) return;
    updated_at = now;
    const float chance = ALPHA * expf(-BETA * weights);
    received = weights = 0;
    if (draw() <= chance) leave(now);
}

static void leave_on(uint32_t now) {
    if (part == SECOND) {
        if (now >= until) walk(now);
    } else if (!may_stay()) {
        part = SECOND;
        until = now + LEFT_TICKS;
    } else if (now - leaves_since >= MOST_LEAVE_TICKS) {
        stay(now);
    }
}

static void avoid_on(uint32_t now) {
    if (now < until) return;
    if (part == SECOND) {
        walk(now);
        return;
    }
    part = SECOND;
    until = now + AVOID_TICKS;
    move(STRAIGHT);
}

static void lengthen_update(void) {
#if GUARDED
    static uint32_t minute;
    const uint32_t now = ticks_now() / MINUTE_TICKS;
    if (now != minute) update_ticks += MINUTE_MORE_TICKS;
    minute = now;
#else
    if (kilo_ticks % MINUTE_TICKS == 0) update_ticks += MINUTE_MORE_TICKS;
#endif
}

// Whether this pass acts: each, or one in STEP_TENTHS tenths of a tick.
static bool is_step(uint32_t now) {
    static uint32_t next_tenths;
    if (STEP_TENTHS == 0) return true;
    if (10 * now < next_tenths) return false;
    next_tenths += STEP_TENTHS;
    return true;
}

static void receive_cell(const message_t *cell) {
    const uint8_t colour = cell->data[CELL_COLOUR];
    on_black = colour == (FLOOR ? FLOOR_BLACK : BLACK);
    on_white = colour == (FLOOR ? FLOOR_WHITE : WHITE_CELL);
    on_wall = FLOOR ? colour > FLOOR_WHITE : cell->data[CELL_IS_WALL] == 1;
}

static void receive_robot(uint8_t uid, uint8_t weight) {
    if (state != STAY || received == MOST_NEIGHBOURS) return;
    for (uint8_t i = 0; i < received; i++)
        if (neighbours[i] == uid) return;
    neighbours[received++] = uid;
    weights += weight;
}

static void receive(message_t *m, distance_measurement_t *distance) {
    (void)distance;
    if (m->type == MESSAGE_CELL)
        receive_cell(m);
    else if (m->type == MESSAGE_ROBOT && m->data[ROBOT_UID] != 0)
        receive_robot(m->data[ROBOT_UID], m->data[ROBOT_WEIGHT]);
}

static message_t *transmit(void) { return state == STAY ? &message : NULL; }

static void setup(void) {
    message.type = MESSAGE_ROBOT;
    message.data[ROBOT_UID] = (uint8_t)kilo_uid;
    message.data[ROBOT_WEIGHT] = INFORMED_FOR == 0 ? 1 : WEIGHT;
    message.crc = message_crc(&message);
    kilo_tx_period = TX_PERIOD;
    walk(ticks_now());
}

static void loop(void) {
    const uint32_t now = ticks_now();
    if (!is_step(now)) return;
    if (UPDATE_S == 0) lengthen_update();
    switch (state) {
    case WALK: walk_on(now); break;
    case ENTER: enter_on(now); break;
    case STAY: stay_on(now); break;
    case LEAVE: leave_on(now); break;
    case OBSTACLE: avoid_on(now); break;
    }
}

int main(void) {
    kilo_init();
    kilo_message_rx = receive;
    kilo_message_tx = transmit;
    kilo_start(setup, loop);
    return 0;
}
