/// The cells tell robots what they stand on, and robots' reports go on to the host.
#include "cell.h"

#include "../../firmware/aggregation/wire.h"
#include "../runtime/include/CAN.h"
#include "../runtime/include/module.h"
#include "../runtime/include/moduleIR.h"
#include "../runtime/include/moduleLED.h"

// The host's other commands change lights and stop the cells' messages: about once a second both
// are put right.
#define SHOW_EVERY_TICKS 31

static uint32_t show_at;

static void show(cell_num_t number, cell_t cell) {
    set_LED_with_brightness(number, (color_t)cell.colour, (brightness_t)cell.brightness);
    if (!cell.speaks) {
        disable_IR_tx(number);
        return;
    }
    IR_message_t message;
    init_IR_message(&message);
    message.type = WIRE_TYPE_CELL;
    wire_put_cell(message.data, (wire_cell_t){cell.site, cell.flags});
    set_IR_message(&message, number);
}

static void show_all(void) {
    for (uint8_t i = 0; i < N_CELLS; i++)
        show((cell_num_t)i, cell_of(configuration, configuration_size, i));
}

// A report that the module's store takes waits there for the host's next poll.
static void on_message(IR_message_t *message, cell_num_t cell, distance_measurement_t *distance,
                       uint8_t crc_error) {
    (void)distance;
    if (crc_error || message->type != WIRE_TYPE_TRACKING) return;
    CAN_message_t *record = next_CAN_message();
    // The store is full: the report is lost, and the robot sends another one soon.
    if (record != NULL)
        serialize_tracking_message(record, cell, (tracking_user_data_t *)message->data);
}

// By the first loop() after RUN the lights have shown something else.
static void setup(void) {
    show_all();
    show_at = module_ticks;
}

static void loop(void) {
    const uint32_t now = module_ticks;
    if ((int32_t)(now - show_at) < 0) return;
    show_at = now + SHOW_EVERY_TICKS;
    show_all();
}

int main(void) {
    module_init();
    module_IR_message_rx = on_message;
    module_start(setup, loop);
    return 0;
}
