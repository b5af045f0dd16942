// Collective perception: robots agree on the commonest colour of the floor
// (docs/collective_perception.md 1). Written from the facts of that page, to be held against the
// logs of a hundred real robots that ran the lab's program.
//
// A robot walks about and counts how many of the cells that it receives have the colour of its
// opinion. Then it tells its opinion to others, the longer the better it has found it, and takes
// that of most of the five robots that it has received last.
#include <kilo_rand_lib.h>
#include <kilob_cdms.h>
#include <kilob_messaging.h>
#include <kilob_random_walk.h>
#include <kilob_tracking.h>
#include <kilob_wall_avoidance.h>
#include <kilolib.h>
#include <stdbool.h>
#include <utils.h>

#include "messages.h"

#ifndef EXPLORATION_MEAN_S
#define EXPLORATION_MEAN_S 300.0f
#endif
#ifndef DISSEMINATION_MEAN_S
#define DISSEMINATION_MEAN_S 900.0f  // at the best quality
#endif
#define BROADCAST_S 0.5f
#define NEIGHBOURS 5
#define BLINK_PASSES 500

typedef enum { STANDING, WALKING, AVOIDING } action_t;
typedef enum { INITIAL, EXPLORATION, DISSEMINATION, DECISION } state_t;

// A cell's message changes them too, in the receiver's interrupt.
static volatile action_t action = STANDING;
static volatile state_t state = INITIAL;
static volatile uint16_t explored, matched;
static volatile float state_ends_s;

static volatile opinion_t opinion;
static float quality;
static float broadcast_at_s;
static bool broadcast_failed;
static uint16_t blink;

static float seconds(void) { return (float)kilo_ticks / TICKS_PER_SEC; }

static float time_of(float mean_s) { return (float)kilob_cdms_duration(mean_s); }

static void begin_exploration(void) {
    explored = matched = 0;
    state_ends_s = seconds() + time_of(EXPLORATION_MEAN_S);
    state = EXPLORATION;
}

static void receive_cell(IR_message_t *message, distance_measurement_t *distance) {
    if (state == INITIAL) {
        action = WALKING;
        begin_exploration();
    }
    if (message->data[CELL_IS_WALL] == 1) {
        action = AVOIDING;
        kilob_on_wall_detected(distance, message);
    }
    if (state != EXPLORATION) return;
    explored++;
    if (message->data[CELL_OPTION] == opinion) matched++;
}

static void receive(IR_message_t *message, distance_measurement_t *distance) {
    if (message->type == MESSAGE_CELL)
        receive_cell(message, distance);
    else if (message->type == MESSAGE_OPINION && state == DISSEMINATION)
        kilob_cdms_collect(message->data[0], message->data[1], 0);
}

static void move(void) {
    switch (action) {
    case WALKING: kilob_random_walk(); break;
    case AVOIDING:
        if (!kilob_wall_avoidance()) action = WALKING;
        break;
    default: set_motors(0, 0);
    }
}

static void show_opinion(void) {
    static const uint8_t colours[OPTIONS] = {RGB(1, 0, 0), RGB(0, 0, 1), RGB(1, 1, 0), RGB(1, 1, 1),
                                             RGB(0, 1, 0)};
    set_color(colours[opinion]);
}

// The counters stand still outside of exploration.
static bool broadcast(void) {
    IR_message_t *message = kilob_message_send();
    if (message == NULL) return false;
    message->type = MESSAGE_OPINION;
    message->data[0] = (uint8_t)kilo_uid;
    message->data[1] = opinion;
    message->data[2] = (uint8_t)matched;
    message->data[3] = (uint8_t)explored;
    return true;
}

static void explore(float now_s) {
    show_opinion();
    if (now_s <= state_ends_s) return;
    state = DISSEMINATION;
    quality = explored == 0 ? 0 : (float)matched / (float)explored;
    state_ends_s = now_s + time_of(DISSEMINATION_MEAN_S * quality);
    broadcast_failed = true;  // it is due at once
}

// While the queue is full it tries again in each pass, so that reports seldom find a place.
static void disseminate(float now_s) {
    if (broadcast_failed || broadcast_at_s <= now_s) {
        broadcast_failed = !broadcast();
        broadcast_at_s = now_s + BROADCAST_S;
    }
    if (now_s >= state_ends_s && kilob_cdms_count_collected_opinions() >= NEIGHBOURS) {
        state = DECISION;
        return;
    }
    if (blink < BLINK_PASSES)
        set_color(RGB(0, 0, 0));
    else
        show_opinion();
    if (++blink == 2 * BLINK_PASSES) blink = 0;
}

static void decide(void) {
    opinion = kilob_cdms_majority_rule(opinion);
    quality = 0;
    begin_exploration();
}

static void report(void) {
    tracking_user_data_t data = {
        {(uint8_t)kilo_uid, opinion, (uint8_t)state, (uint8_t)action, (uint8_t)(quality * 255)}};
    kilob_tracking(&data);
}

static void setup(void) {
    g_ran_set_seed_uint32(0);
    kilob_tracking_init();
    kilob_random_walk_init(15, 1.5, 0.5, 3);
    kilob_wall_avoidance_init();
    kilob_cdms_init(OPTIONS, NEIGHBOURS);
    opinion = kilob_cdms_random_opinion();
}

static void loop(void) {
    move();
    const float now_s = seconds();
    switch (state) {
    case INITIAL: show_opinion(); break;
    case EXPLORATION: explore(now_s); break;
    case DISSEMINATION: disseminate(now_s); break;
    case DECISION: decide(); break;
    }
    report();
}

int main(void) {
    kilo_init();
    utils_init();
    utils_message_rx = receive;
    kilo_start(setup, loop);
    return 0;
}
