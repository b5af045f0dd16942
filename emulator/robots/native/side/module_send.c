// Frames that a module program sends by itself. Only programs that do so link it: for all others
// the engine knows when their next frame may begin.
#include "CAN.h"
#include "abi.h"
#include "moduleIR.h"
#include "side.h"

__attribute__((visibility("hidden"))) const uint8_t kt_acts_alone = 1;

uint8_t CAN_message_tx(CAN_message_t *message, kilogrid_address_t to) {
    kt_host->module->send_can((const kt_can_message_t *)message, to.x, to.y, to.type);
    module_CAN_message_tx_success();
    return 1;
}

void CAN_send_broadcast_message(CAN_message_t *message) {
    kt_host->module->broadcast_can((const kt_can_message_t *)message);
}

void send_IR_message(IR_message_t *message, cell_num_t cell) {
    message->crc = message_crc(message);
    kt_host->module->send_at_once(cell, message);
}
