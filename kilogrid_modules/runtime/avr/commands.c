/// Obeys the host: every frame that the controller lets through comes by here.
#include <avr/eeprom.h>
#include <string.h>
#include <util/atomic.h>

#include "bus.h"
#include "clock.h"
#include "infrared.h"
#include "module.h"
#include "places.h"
#include "states.h"

// The boot section is there whatever the program is. An absolute jump: a call through a pointer
// would take this number for a count of words.
#define BOOT_LOADER "0x7000"
// What older boot loaders know the pages of a program and IDLE by.
#define OLD_NAME 0x9F
#define HEALTH_PARTS 2

volatile module_state_t runtime_module_state;
transfer_t runtime_transfer;
orders_t runtime_orders;

static uint8_t refused;

uint8_t runtime_frames_refused(void) { return refused; }

void runtime_count_refused(uint8_t frames) {
    refused = frames < UINT8_MAX - refused ? (uint8_t)(refused + frames) : UINT8_MAX;
}

void runtime_enter_state(module_state_t state) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (state != STATE_RUNNING) runtime_orders.started = false;
        runtime_module_state = state;
    }
}

static void enter(module_state_t state) {
    transfer_abandon_config(&runtime_transfer);
    runtime_enter_state(state);
}

static void __attribute__((noreturn)) enter_boot_loader(void) {
    cli();
    runtime_clock_stop();
    wdt_disable();
    __asm__ volatile("jmp " BOOT_LOADER);
    __builtin_unreachable();
}

static void hand_over(const can_frame_t *frame) {
    const uint8_t header = (uint8_t)(frame->length << 1);  // rtr 0
    CAN_message_t message = {.id = frame->id};
    memcpy(&message.header, &header, sizeof message.header);
    memcpy(message.data, frame->data, sizeof message.data);
    (*module_CAN_message_rx)(&message);
}

// Calibration may be for some modules only: those with robots to be calibrated on them.
static bool is_outside(void) {
    const uint8_t x = module_uid_x_coord, y = module_uid_y_coord;
    return eeprom_read_byte(PLACE(CALIBRATION_RESTRICTED)) == 1 &&
           (x < eeprom_read_byte(PLACE(CALIBRATION_X_MIN)) ||
            x > eeprom_read_byte(PLACE(CALIBRATION_X_MAX)) ||
            y < eeprom_read_byte(PLACE(CALIBRATION_Y_MIN)) ||
            y > eeprom_read_byte(PLACE(CALIBRATION_Y_MAX)));
}

static void forward_message(void) {
    if (runtime_transfer.ir.type == CALIB && is_outside()) return;
    if (runtime_transfer.ir.type == BOOT)
        runtime_orders.page_cell = runtime_orders.pages_received = 0;
    enter(STATE_SETUP_KILOBOTS);
}

static void take_configuration(void) {
    for (uint8_t i = 0; i < runtime_transfer.config.size; i++)
        configuration[i] = runtime_transfer.config.data[i];
    runtime_orders.set_up = false;
    runtime_enter_state(STATE_SETUP);
}

static void transferred(transfer_event_t event) {
    switch (event) {
    case TRANSFER_CONFIG_BEGUN:
        configuration_size = runtime_transfer.config.size;
        runtime_enter_state(STATE_WAITING_FOR_CONFIGURATION);
        break;
    case TRANSFER_CONFIG_DONE: take_configuration(); break;
    case TRANSFER_IR_DONE: forward_message(); break;
    case TRANSFER_PAGE_BEGUN: enter(STATE_WAITING_FOR_PAGE); break;
    case TRANSFER_PAGE_DONE:
        runtime_orders.pages_received++;
        runtime_orders.page = true;
        runtime_enter_state(STATE_BOOTLOADING_KILOBOTS);
        break;
    case TRANSFER_REFUSED: runtime_count_refused(1); break;
    default: break;
    }
}

static void ask_for_health(const can_frame_t *frame) {
    if (frame->length < 2 || frame->data[1] >= HEALTH_PARTS) {
        runtime_count_refused(1);
    } else {
        const uint8_t part = frame->data[1] == 0 ? 1 : 2;
        runtime_orders.health |= part;
    }
}

static bool is_for_boot_loader(uint8_t type) {
    const uint8_t name = type >= OLD_NAME ? (uint8_t)(type - OLD_NAME) : type;
    return name >= CAN_MODULE_BOOTPAGE && name <= CAN_MODULE_BOOTPAGE_NUMBER;
}

static void obey(const can_frame_t *frame) {
    switch (frame->data[0]) {
    case CAN_FORWARD_IR_MESSAGE_STOP:
        memset(&runtime_transfer.ir, 0, sizeof runtime_transfer.ir);
        runtime_infrared_silence();
        enter(STATE_IDLE);
        break;
    case CAN_MODULE_BOOT: enter_boot_loader();
    case CAN_MODULE_IDLE: enter(STATE_IDLE); break;
    case CAN_MODULE_SETUP: enter(STATE_SETUP); break;
    case CAN_MODULE_RUN: enter(STATE_RUNNING); break;
    case CAN_MODULE_PAUSE: break;
    case CAN_TRACKING_REQ: runtime_orders.poll = true; break;
    case CAN_MODULE_DATA: ask_for_health(frame); break;
    default: hand_over(frame); break;
    }
}

void runtime_bus_received(const can_frame_t *frame) {
    if (frame->rtr || frame->length == 0) {
        runtime_count_refused(1);
        return;
    }
    if (is_for_boot_loader(frame->data[0])) {
        hand_over(frame);
        return;
    }
    const transfer_event_t event = transfer_receive(&runtime_transfer, frame->data, frame->length);
    if (event == TRANSFER_NOT_MINE) {
        obey(frame);
    } else {
        transferred(event);
    }
}
