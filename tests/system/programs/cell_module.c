// A module program in the labs' style: cells say what the configuration says, and pass on reports.
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"

static IR_message_t messages[N_CELLS];
static CAN_message_t *record;

static void on_infrared(IR_message_t *m, cell_num_t cell, distance_measurement_t *d,
                        uint8_t crc_error) {
    (void)d;
    if (crc_error || m->type != TRACKING) return;
    record = next_CAN_message();
    if (record != NULL) serialize_tracking_message(record, cell, (tracking_user_data_t *)m->data);
}

static void setup(void) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        init_IR_message(&messages[cell]);
        messages[cell].type = 0x01;
        messages[cell].data[0] = configuration[cell] & 0x0F;
        messages[cell].data[1] = configuration[cell] >> 7;
    }
}

static void loop(void) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) {
        set_LED(cell, (color_t)(configuration[cell] >> 4 & 7));
        set_IR_message(&messages[cell], cell);
    }
}

int main(void) {
    module_init();
    module_IR_message_rx = on_infrared;
    module_start(setup, loop);
    return 0;
}
