"""The begin of a lab's program for modules, in C: a record for each tracking message of a robot."""

RECEIVES = """\
#include <CAN.h>
#include <kilogrid.h>
#include <module.h>
#include <moduleIR.h>
#include <moduleLED.h>
static void receive(IR_message_t *message, cell_num_t cell, distance_measurement_t *distance,
                    uint8_t crc_error) {
    (void)distance;
    if (crc_error || message->type != TRACKING) return;
    CAN_message_t *record = next_CAN_message();
    if (record == NULL) return;
    serialize_tracking_message(record, cell, (tracking_user_data_t *)message->data);
}
"""
