/* Cells of a best-of-n experiment. Ten configuration bytes: column and row of the module, the roles
 * of its four cells, their options. Modules with a sender's role tell others of their option, by
 * frames on the bus; who receives one within its range shows it. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <math.h>
#include <stdlib.h>
#include <util/delay.h>

#include "CAN.h"
#include "mcp2515.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"

#define TO_ALL 1
#define TO_NEXT 2
#define TO_ROW 3
#define TO_COLUMN 4

typedef enum {
    false = 0,
    true = 1,
} bool;

cell_num_t cell_id[4] = {CELL_00, CELL_01, CELL_02, CELL_03};
volatile uint8_t cell_x[4], cell_y[4], cell_role[4], cell_option[4];
uint8_t cell_it;
IR_message_t IR_message_tx[4];

CAN_message_t out;
volatile uint8_t received[4];  // from module 0-0, 1-0, 0-1, 1-1
volatile uint8_t told_option;
uint32_t next_tick = 0;

void IR_rx(IR_message_t *m, cell_num_t c, distance_measurement_t *d, uint8_t CRC_error) {
    if (!CRC_error && m->type == TRACKING) {
        CAN_message_t *msg = next_CAN_message();
        tracking_user_data_t usr_data;
        for (uint8_t i = 0; i < TRACKING_MSG_USER_DATA; i++) usr_data.byte[i] = m->data[i];
        if (msg != NULL) serialize_tracking_message(msg, c, &usr_data);
    }
}

void CAN_rx(CAN_message_t *m) {
    if (m->data[0] != CAN_MODULE_TO_MODULE) return;
    uint8_t from = (m->data[1] / 2) + 2 * (m->data[2] / 2);
    double away = sqrt(pow(fabs((double)m->data[1] - cell_x[0]), 2) +
                       pow(fabs((double)m->data[2] - cell_y[0]), 2));
    if (away < m->data[3]) {
        received[from & 3]++;
        told_option = m->data[4];
    }
}

void setup() {
    for (cell_it = 0; cell_it < 4; cell_it++) {
        cell_x[cell_it] = configuration[0] * 2 + (cell_it & 1);
        cell_y[cell_it] = configuration[1] * 2 + (cell_it < 2 ? 1 : 0);
        cell_role[cell_it] = configuration[2 + cell_it];
        cell_option[cell_it] = configuration[6 + cell_it];
    }
    for (cell_it = 0; cell_it < 4; cell_it++) received[cell_it] = 0;
}

void tell(uint8_t role) {
    kilogrid_address_t to;
    init_CAN_message(&out);
    out.data[0] = CAN_MODULE_TO_MODULE;
    out.data[1] = cell_x[0];
    out.data[2] = cell_y[0];
    out.data[3] = 10;
    out.data[4] = cell_option[0];
    to.x = configuration[0];
    to.y = configuration[1];
    switch (role) {
    case TO_ALL: CAN_send_broadcast_message(&out); return;
    case TO_NEXT:
        to.type = ADDR_INDIVIDUAL;
        to.y = configuration[1] + 1;
        break;
    case TO_ROW: to.type = ADDR_ROW; break;
    case TO_COLUMN: to.type = ADDR_COLUMN; break;
    default: return;
    }
    CAN_message_tx(&out, to);
}

void loop() {
    for (cell_it = 0; cell_it < 4; cell_it++) {
        IR_message_tx[cell_it].type = 11;
        IR_message_tx[cell_it].crc = 0;
        IR_message_tx[cell_it].data[0] = cell_x[cell_it];
        IR_message_tx[cell_it].data[1] = cell_y[cell_it];
        IR_message_tx[cell_it].data[2] = cell_option[cell_it];
        IR_message_tx[cell_it].data[3] = cell_role[cell_it];
        set_IR_message(&IR_message_tx[cell_it], cell_id[cell_it]);
        // Brightness shows the frames that came from each of four modules.
        set_LED_with_brightness(cell_id[cell_it], told_option, received[cell_it]);
    }
    if (module_ticks >= next_tick) {
        next_tick = module_ticks + 32;
        tell(cell_role[0]);
    }
    _delay_ms(10);
}

int main() {
    module_init();
    module_IR_message_rx = IR_rx;
    module_CAN_message_rx = CAN_rx;
    module_start(setup, loop);
    return 0;
}
