/* An ant: walks at random, leaves pheromone every two seconds, turns away from obstacle cells,
 * reports what it stands on. */
#include <kilolib.h>
#include <stdbool.h>

#include "kilo_rand_lib.h"
#include "kilob_messaging.h"
#include "kilob_random_walk.h"
#include "kilob_tracking.h"
#include "utils.h"

#define OBSTACLE 1
#define MSG_CELL 1
#define MSG_DEPOSIT 5

static volatile bool at_obstacle;
static volatile uint8_t pheromone, column, row;
static bool avoiding;
static uint32_t avoid_until, straight_until, deposited_at;
static tracking_user_data_t report;

void on_message(IR_message_t *m, distance_measurement_t *d) {
    if (m->type != MSG_CELL) return;
    at_obstacle = m->data[0] == OBSTACLE;
    pheromone = m->data[1];
    column = m->data[2];
    row = m->data[3];
}

void setup(void) {
    g_ran_set_seed_uint32(0);
    kilob_random_walk_reset();
    deposited_at = kilo_ticks + g_ran_uniform_uint32() % SEC_TO_TICKS(2);
}

/* Turn for one to five seconds, then straight on for three, whatever the cell says. */
static void avoid(void) {
    if (!avoiding) {
        avoiding = true;
        avoid_until = kilo_ticks + SEC_TO_TICKS(1) + g_ran_uniform_uint32() % SEC_TO_TICKS(4);
        straight_until = avoid_until + SEC_TO_TICKS(3);
        set_color(RGB(3, 0, 0));
    }
    if (kilo_ticks < avoid_until) {
        turn_left();
    } else if (kilo_ticks < straight_until) {
        move_straight();
    } else {
        avoiding = false;
        kilob_random_walk_reset();
    }
}

void loop(void) {
    if (avoiding || at_obstacle) {
        avoid();
    } else {
        set_color(RGB(0, 3, 0));
        kilob_random_walk();
    }
    if (kilo_ticks - deposited_at > SEC_TO_TICKS(2) && (int32_t)(kilo_ticks - deposited_at) > 0) {
        IR_message_t *m = kilob_message_send();
        if (m != NULL) {
            m->type = MSG_DEPOSIT;
            m->data[0] = kilo_uid & 0xFF;
            deposited_at = kilo_ticks;
        }
    }
    report.byte[0] = kilo_uid & 0x7F;
    report.byte[1] = column;
    report.byte[2] = row;
    report.byte[3] = pheromone;
    report.byte[4] = at_obstacle;
    kilob_tracking(&report);
}

int main(void) {
    kilo_init();
    utils_init();
    utils_message_rx = on_message;
    kilob_messaging_init();
    kilob_tracking_init();
    kilob_random_walk_init(6, 1, 1, 2);
    kilo_start(setup, loop);
    return 0;
}
