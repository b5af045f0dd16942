/* Best of n: robots look which options cells have, tell one another of theirs, and change it for
 * what they hear; zealots, every fourth robot, never do. Written as labs write it: a table of all
 * cells, a half for a simulator, and a function that forgets to return what its caller takes. */
#include <kilolib.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifdef SIMULATION
#include "agent.h"
#include <debug.h>
#else
#include "kilo_rand_lib.h"
#include "kilob_messaging.h"
#include "kilob_tracking.h"
#include "utils.h"
#include <util/delay.h>
#endif

#define GRID_MSG 11
#define ROBOT_MSG 2

typedef enum {
    false = 0,
    true = 1,
} bool;
typedef enum { STOP_N = 0, FORWARD_N, TURN_N } motion_t;

#ifdef SIMULATION
#define MSG_SEND_TRIES 1
message_t message;
#else
#define MSG_SEND_TRIES 10
IR_message_t message;
#endif

int foundmodules[18][38] = {0};
int heard_options[120] = {0};
int heard_count = 0;
int total_tiles_found = 0;
int currentopinion = 0;
int is_zealot = 0;
bool new_message = false;
motion_t current_motion = STOP_N;
uint32_t last_motion_ticks = 0;
uint32_t last_changed = 0;
double timer = 0;
tracking_user_data_t tracking_data;

double ran_expo(double lambda) {
    double u = rand() / (RAND_MAX + 1.0);
    return -log(1 - u) / lambda;
}

unsigned int GetRandomNumber(unsigned int range_rnd) {
    int randomInt = RAND_MAX;
    while (randomInt > 30000) {
        randomInt = rand();
    }
    return randomInt % range_rnd + 1;
}

int quality(int tiles) {
    if (tiles > 0) currentopinion = currentopinion;
}

void set_motion(motion_t motion) {
    if (motion == current_motion) return;
    spinup_motors();
    switch (motion) {
    case FORWARD_N: set_motors(kilo_straight_left, kilo_straight_right); break;
    case TURN_N: set_motors(kilo_turn_left, 0); break;
    case STOP_N: set_motors(0, 0); break;
    }
    current_motion = motion;
}

void random_walk() {
    if (kilo_ticks < last_motion_ticks) return;
    set_motion(current_motion == FORWARD_N ? TURN_N : FORWARD_N);
    last_motion_ticks = kilo_ticks + 60 + GetRandomNumber(50);
}

void message_rx(IR_message_t *msg, distance_measurement_t *d) {
    if (msg->type == GRID_MSG && msg->data[0] < 18 && msg->data[1] < 38) {
        if (foundmodules[msg->data[0]][msg->data[1]] == 0) {
            foundmodules[msg->data[0]][msg->data[1]] = 1;
            total_tiles_found += 1;
        }
        if (currentopinion == 0) currentopinion = msg->data[2];
    }
    if (msg->type == ROBOT_MSG) {
        heard_options[heard_count++ % 120] = msg->data[1];
        new_message = true;
    }
}

message_t *message_tx() {
    message.type = ROBOT_MSG;
    message.data[1] = currentopinion;
    message.crc = message_crc(&message);
    return &message;
}

void setup() {
    srand(rand_hard());
    is_zealot = kilo_uid % 4 == 0;
    if (is_zealot) currentopinion = 2;
    timer = ran_expo(1.0 / 100);
    tracking_data.byte[0] = kilo_uid;
#ifndef SIMULATION
    kilob_tracking_init();
    utils_message_rx = message_rx;
#endif
    kilo_message_tx = message_tx;
}

void loop() {
    random_walk();
    if ((kilo_ticks - last_changed) > timer) {
        last_changed = kilo_ticks;
        timer = ran_expo(1.0 / 100);
        if (new_message && !is_zealot) currentopinion = heard_options[(heard_count - 1) % 120];
        new_message = false;
        tracking_data.byte[2] = quality(total_tiles_found);
        memset(foundmodules, 0, sizeof(foundmodules[0][0]) * 18 * 38);
    }
    set_color(currentopinion == 2 ? RGB(0, 0, 1) : currentopinion == 1 ? RGB(1, 0, 0) : 0);
#ifdef SIMULATION
    debug_info_set(currentopinion, currentopinion);
#else
    tracking_data.byte[1] = currentopinion;
#endif
}

int main() {
    kilo_init();
#ifdef SIMULATION
    debug_info_create();
#else
    utils_init();
#endif
    kilo_start(setup, loop);
    return 0;
}
