/* Cells of two colours; what a cell is, robots count. A robot's vote is shown by the cell it stands
 * on for a while. */
#include <avr/io.h>

#include "CAN.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"

#define MSG_OPTION 1
#define MSG_VOTE 2
#define SHOW_TICKS SEC_TO_TICKS(3)

IR_message_t message[N_CELLS];
volatile uint8_t vote[N_CELLS];
volatile uint32_t vote_until[N_CELLS];
uint32_t advertise_at;

void IR_rx(IR_message_t *m, cell_num_t c, distance_measurement_t *d, uint8_t CRC_error) {
    if (CRC_error) return;
    if (m->type == TRACKING) {
        CAN_message_t *record = next_CAN_message();
        if (record != NULL) serialize_tracking_message(record, c, (tracking_user_data_t *)m->data);
        /* the vote travels in the report */
        vote[c] = m->data[2];
        vote_until[c] = module_ticks + SHOW_TICKS;
    }
}

void setup() {
    for (int i = 0; i < N_CELLS; i++) {
        init_IR_message(&message[i]);
        message[i].type = MSG_OPTION;
        message[i].data[0] = configuration[i];
        vote_until[i] = 0;
    }
    advertise_at = module_ticks;
}

void loop() {
    static uint8_t i;
    if (module_ticks < advertise_at) return;
    advertise_at = module_ticks + TICKS_PER_SEC / 2;
    for (i = 0; i < N_CELLS; i++) {
        set_IR_message(&message[i], (cell_num_t)i);
        if (module_ticks < vote_until[i])
            set_LED_with_brightness((cell_num_t)i, vote[i] == 1 ? CYAN : MAGENTA, HIGH);
        else
            set_LED((cell_num_t)i, configuration[i] == 1 ? BLUE : RED);
    }
}

int main() {
    module_init();
    module_IR_message_rx = IR_rx;
    module_start(setup, loop);
}
