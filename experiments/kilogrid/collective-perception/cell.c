// The modules' part of collective perception (docs/collective_perception.md 1): each cell shows its
// option and tells robots of it, and robots' reports go on to the host.
#include <CAN.h>
#include <kilogrid.h>
#include <module.h>
#include <moduleIR.h>
#include <moduleLED.h>
#include <stdbool.h>

#include "messages.h"

#define ADVERTISE_TICKS (TICKS_PER_SEC / 2)

static uint32_t advertise_at;

static void receive(IR_message_t *message, cell_num_t cell, distance_measurement_t *distance,
                    uint8_t crc_error) {
    (void)distance;
    if (crc_error || message->type != TRACKING) return;
    CAN_message_t *record = next_CAN_message();
    if (record == NULL) return;
    serialize_tracking_message(record, cell, (tracking_user_data_t *)message->data);
}

static void advertise(cell_num_t cell) {
    IR_message_t message;
    init_IR_message(&message);
    message.type = MESSAGE_CELL;
    message.data[CELL_OPTION] = configuration[cell] & CONFIG_OPTION;
    message.data[CELL_IS_WALL] = (configuration[cell] & CONFIG_WALL) != 0;
    set_IR_message(&message, cell);
}

static void setup(void) { advertise_at = module_ticks; }

static void loop(void) {
    static const color_t colours[OPTIONS] = {RED, BLUE, YELLOW, WHITE, GREEN};
    const bool due = module_ticks >= advertise_at;
    if (due) advertise_at = module_ticks + ADVERTISE_TICKS;
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        const uint8_t option = configuration[cell] & CONFIG_OPTION;
        set_LED((cell_num_t)cell, option < OPTIONS ? colours[option] : MAGENTA);
        if (due) advertise((cell_num_t)cell);
    }
}

int main(void) {
    module_init();
    module_IR_message_rx = receive;
    module_start(setup, loop);
}
