// Acts by itself: starts without a host, sends by infrared at once and by CAN to all, waits,
// answers frames of its own kind, keeps count in the EEPROM, prints.
#include <stdlib.h>

#include "CAN.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"
#include "rand.h"

#define BOOTS ((uint8_t *)0x100)
#define ASKED 0x3A
#define ANSWERED 0x3B

static uint8_t sent, answers;
static uint32_t rounds;

static void can_rx(CAN_message_t *m) {
    if (m->data[0] != ASKED) return;
    const kilogrid_address_t from = get_coord_from_CAN_ID(m);
    CAN_message_t answer;
    init_CAN_message(&answer);
    answer.header.length = 6;
    answer.data[0] = ANSWERED;
    answer.data[1] = from.x;
    answer.data[2] = from.y;
    answer.data[3] = from.type;
    answer.data[4] = m->header.length;
    answer.data[5] = eeprom_read_byte(BOOTS);
    const kilogrid_address_t host = {module_uid_x_coord, module_uid_y_coord, ADDR_DISPATCHER};
    answers += CAN_message_tx(&answer, host);
}

static void can_sent(void) { sent++; }

static void setup(void) {
    cprints("setup");
    cprinti(configuration_size);
    set_all_LEDs_hex((uint8_t[]){1, 2, 3});
    srandom(rand_hard());
}

static void loop(void) {
    IR_message_t m;
    init_IR_message(&m);
    m.type = 0x22;
    m.data[0] = (uint8_t)rounds;
    m.data[1] = sent;
    send_IR_message(&m, rounds % N_CELLS);
    if (rounds % 10 == 0) {
        CAN_message_t all;
        init_CAN_message(&all);
        all.data[0] = 0x3C;
        all.data[1] = (uint8_t)rounds;
        CAN_send_broadcast_message(&all);
    }
    rounds++;
    _delay_ms(100);
}

int main() {
    module_init();
    eeprom_write_byte(BOOTS, (uint8_t)(eeprom_read_byte(BOOTS) + 1));
    module_CAN_message_rx = can_rx;
    module_CAN_message_tx_success = can_sent;
    module_enable_autostart();
    module_start(setup, loop);
}
