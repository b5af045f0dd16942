// In the manner of the labs' robot programs for the Kilogrid: reports every two seconds, walks at
// random, avoids cells marked as obstacles, drops something where its cell asks for it.
#include <math.h>
#include <stdlib.h>

#include <kilo_rand_lib.h>
#include <kilob_messaging.h>
#include <kilob_random_walk.h>
#include <kilob_tracking.h>
#include <kilogrid.h>
#include <kilolib.h>
#include <ringbuffer.h>
#include <utils.h>

#define CELL_STATE 1
#define OBSTACLE 9
#define DROP 0x21

typedef enum { INITIAL, WALKING, AVOIDING } robot_state_t;

static robot_state_t state;
static tracking_user_data_t tracking_data;
static uint32_t avoid_until;
static uint8_t heard;

RB_create(codes, uint8_t, 4);

void IR_rx(IR_message_t *m, distance_measurement_t *d) {
    if (m->type != CELL_STATE) return;
    heard++;
    RB_back(codes) = m->data[0];
    RB_pushback(codes);
    if (state == INITIAL) state = WALKING;
    if (m->data[0] == OBSTACLE && state == WALKING) {
        state = AVOIDING;
        avoid_until = kilo_ticks + SEC_TO_TICKS(2);
    }
}

static inline void drop() {
    IR_message_t *msg = kilob_message_send();
    if (msg == NULL) return;
    msg->type = DROP;
    msg->data[0] = kilo_uid;
}

void setup() {
    RB_init(codes);
    g_ran_set_seed_uint32(0);
    kilob_tracking_init();
    kilob_random_walk_init(3.0, 1.5, 1.5, 3.0);
    tracking_data.byte[0] = kilo_uid;
}

void loop() {
    switch (state) {
    case WALKING:
        set_color(RGB(0, 1, 0));
        kilob_random_walk();
        break;
    case AVOIDING:
        set_color(RGB(1, 0, 0));
        turn_left();
        if (kilo_ticks > avoid_until) {
            state = WALKING;
            drop();
            kilob_random_walk_reset();
        }
        break;
    default: set_color(RGB(0, 0, 1));
    }
    tracking_data.byte[1] = state;
    tracking_data.byte[2] = heard;
    tracking_data.byte[3] = RB_size(codes);
    kilob_tracking(&tracking_data);
}

int main() {
    kilo_init();
    utils_init();
    utils_message_rx = IR_rx;
    kilo_start(setup, loop);
    return 0;
}
