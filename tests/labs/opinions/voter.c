/* Collective perception: which colour do more cells have? Each robot explores, counts the cells it
 * receives, and then sends its neighbours the result; those that explored less follow the majority
 * of the messages they receive. */
#include <kilolib.h>
#include <stdlib.h>
#include <string.h>

#include "kilo_rand_lib.h"
#include "kilob_messaging.h"
#include "kilob_random_walk.h"
#include "kilob_tracking.h"
#include "ringbuffer.h"
#include "utils.h"

#define MSG_OPTION 1
#define MSG_OPINION 3
#define EXPLORE_TICKS SEC_TO_TICKS(60)

typedef enum { EXPLORING, TELLING } phase_t;

RB_create(heard, uint8_t, 8);

static phase_t phase;
static uint16_t count[3];
static uint8_t opinion;
static uint32_t phase_began, told_at;
static tracking_user_data_t report;

void rx(IR_message_t *m, distance_measurement_t *d) {
    if (m->type == MSG_OPTION && m->data[0] >= 1 && m->data[0] <= 2) {
        count[m->data[0]]++;
    } else if (m->type == MSG_OPINION) {
        if (RB_full(heard)) RB_popfront(heard);
        RB_back(heard) = m->data[1];
        RB_pushback(heard);
    }
}

static void decide(void) {
    uint8_t votes[3] = {0, 0, 0};
    /* its own perception is worth three votes */
    if (count[1] != count[2]) votes[count[1] > count[2] ? 1 : 2] += 3;
    while (!RB_empty(heard)) {
        uint8_t other = RB_front(heard);
        RB_popfront(heard);
        if (other == 1 || other == 2) votes[other]++;
    }
    if (votes[1] != votes[2]) opinion = votes[1] > votes[2] ? 1 : 2;
}

void setup() {
    g_ran_set_seed_uint32(0);
    RB_init(heard);
    opinion = 1 + kilo_uid % 2;
    phase_began = kilo_ticks;
    kilob_random_walk_reset();
}

void loop() {
    kilob_random_walk();
    switch (phase) {
    case EXPLORING:
        if (kilo_ticks - phase_began < EXPLORE_TICKS) break;
        phase = TELLING;
        break;
    case TELLING:
        if (kilo_ticks - told_at < SEC_TO_TICKS(1)) break;
        told_at = kilo_ticks;
        decide();
        IR_message_t *m = kilob_message_send();
        if (m == NULL) break;
        m->type = MSG_OPINION;
        m->data[0] = kilo_uid;
        m->data[1] = opinion;
    }
    set_color(opinion == 1 ? RGB(0, 0, 3) : RGB(3, 0, 0));
    report.byte[0] = kilo_uid & 0x7F;
    report.byte[1] = phase;
    report.byte[2] = opinion;
    kilob_tracking(&report);
}

int main() {
    kilo_init();
    utils_init();
    utils_message_rx = rx;
    kilob_messaging_init();
    kilob_tracking_init();
    kilob_random_walk_init(4, 1, 1, 2);
    kilo_start(setup, loop);
}
