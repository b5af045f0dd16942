/* In the manner of behaviours for the ARGoS simulator's Kilobots: it names fields of debug info
 * that nothing declares, has a bool of its own, and sets its lights where it transmits. A robot
 * walks, stays on a black or white cell, says so, and leaves by chance. */
#include "kilolib.h"

#include "agent.h"

#include <debug.h>
#include <math.h>
#include <stdlib.h>

#include "distribution_functions.c"

#define RANDOM_WALK 0
#define STAY 1
#define LEAVE 2

#define BLACK 20
#define WHITE 21
#define GREY 22

typedef enum {
    false = 0,
    true = 1,
} bool;

int state = 0;
uint32_t timer = 0;
uint32_t walk_duration = 32 * 5;
int ground_color = GREY;
bool obstacle = false;
bool broadcast = false;
int buffer_size = 25;
uint16_t heard[25] = {0};
message_t msg;

void turn_left() {
    spinup_motors();
    set_motors(kilo_turn_left, 0);
}

void move_straight() {
    spinup_motors();
    set_motors(kilo_turn_left, kilo_turn_right);
}

void stop() { set_motors(0, 0); }

bool is_in_site() {
    if (ground_color == WHITE || ground_color == BLACK)
        return true;
    else
        return false;
}

bool leave_site() {
    int n = 0;
    for (int i = 0; i < buffer_size; ++i) {
        if (heard[i] != 0) n++;
        heard[i] = 0;
    }
    double pleave = 0.5 * exp(-2.25 * n);
    double random_number = uniform_distribution(0, 1);
    debug_info_set(drawn_debug, random_number);
    return random_number <= pleave ? true : false;
}

message_t *message_tx() {
    if (broadcast == true) {
        set_color(RGB(1, 1, 1));
        return &msg;
    } else {
        set_color(RGB(0, 0, 0));
        return NULL;
    }
}

void message_rx(message_t *message, distance_measurement_t *distance) {
    if (message->type == 1) {
        ground_color = message->data[0];
        obstacle = message->data[1];
    }
    if (message->type == 2) {
        for (int i = 0; i < buffer_size; ++i) {
            if (heard[i] == message->data[0]) return;
        }
        for (int i = 0; i < buffer_size; ++i) {
            if (heard[i] == 0) {
                heard[i] = message->data[0];
                return;
            }
        }
    }
    return;
}

void setup() {
    msg.type = 2;
    msg.data[0] = kilo_uid;
    msg.crc = message_crc(&msg);
    move_straight();
    timer = kilo_ticks + walk_duration;
}

void loop() {
    debug_info_set(ticks_debug, kilo_ticks);
    switch (state) {
    case RANDOM_WALK:
        if (is_in_site()) {
            stop();
            state = STAY;
            broadcast = true;
            timer = kilo_ticks + 32 * 2;
        } else if (kilo_ticks >= timer) {
            double time = fabs(wrapped_cauchy()) * 180 / PI / 45;
            turn_left();
            delay(time * 1000);
            move_straight();
            timer = kilo_ticks + walk_duration;
        }
        break;
    case STAY:
        if (kilo_ticks >= timer) {
            if (leave_site()) {
                state = LEAVE;
                broadcast = false;
                move_straight();
            }
            timer = kilo_ticks + 32 * 2;
        }
        break;
    case LEAVE:
        if (!is_in_site()) {
            timer = kilo_ticks + walk_duration;
            state = RANDOM_WALK;
        }
        break;
    }
}

int main() {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_rx = message_rx;

    debug_info_create();

    kilo_start(setup, loop);

    return 0;
}
