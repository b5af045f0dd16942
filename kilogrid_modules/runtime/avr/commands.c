#include "commands.h"

#include <avr/eeprom.h>
#include <string.h>

#include "../core/eeprom_map.h"
#include "../core/original_orders.h"
#include "../core/traits.h"
#include "bus.h"
#include "clock.h"
#include "infrared.h"
#include "module.h"

// Address of the boot section in bytes. An absolute jump: a call through a pointer would count
// words.
#define BOOT_LOADER "0x7000"

orders_t runtime_orders;

static void __attribute__((noreturn)) enter_boot_loader(void) {
    cli();
    runtime_clock_stop();
    wdt_disable();
    __asm__ volatile("jmp " BOOT_LOADER);
    __builtin_unreachable();
}

// The API's header is a bit field, written as a byte: rtr is bit 0, the length bits 1 to 4.
static void hand_over(const can_frame_t *frame) {
    const uint8_t header = (uint8_t)(frame->length << 1);
    CAN_message_t message = {.id = frame->id};
    memcpy(&message.header, &header, sizeof message.header);
    memcpy(message.data, frame->data, sizeof message.data);
    (*module_CAN_message_rx)(&message);
}

static void forward_message(void) {
    calibration_area_t area;
    eeprom_read_block(&area, EEPROM_AT(EEPROM_CALIB_RESTRICTED), sizeof area);
    (void)orders_forward(&runtime_orders, module_uid_x_coord, module_uid_y_coord, &area);
}

// In the interrupt that completes the transfer: the next one would overwrite the bytes.
static void take_configuration(void) {
    const transfer_config_t *config = &runtime_orders.transfer.config;
    for (uint8_t i = 0; i < config->size; i++) configuration[i] = config->data[i];
}

static order_t order_of(const can_frame_t *frame) {
    orders_t *orders = &runtime_orders;
    return MODULE_ORIGINAL ? original_receive(orders, frame->data, frame->length, frame->rtr)
                           : orders_receive(orders, frame->data, frame->length, frame->rtr);
}

void runtime_bus_received(const can_frame_t *frame) {
    switch (order_of(frame)) {
    case ORDER_HAND_OVER: hand_over(frame); break;
    case ORDER_CONFIG_SIZE: configuration_size = runtime_orders.transfer.config.size; break;
    case ORDER_CONFIGURE: take_configuration(); break;
    case ORDER_FORWARD: forward_message(); break;
    case ORDER_SILENCE: runtime_infrared_silence(); break;
    case ORDER_BOOT_LOADER: enter_boot_loader();
    default: break;
    }
}
