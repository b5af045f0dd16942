#include "answers.h"

#include <string.h>
#include <util/crc16.h>

#include "bus.h"
#include "clock.h"
#include "kilogrid_can.h"
#include "module.h"
#include "records.h"
#include "states.h"

// The host gets time to take them in.
#define AFTER_START_MS 1
#define AFTER_RECORD_US 500
#define HEALTH_VERSION 1
#define START_BYTES 2

static CAN_message_t broadcast;
static volatile bool broadcast_pending;

static void ignore_rx(CAN_message_t *message) { (void)message; }
static void ignore_tx_success(void) {}

CAN_message_rx_t module_CAN_message_rx = ignore_rx;
CAN_message_tx_success_t module_CAN_message_tx_success = ignore_tx_success;

static can_frame_t frame_of(const CAN_message_t *message) {
    can_frame_t frame = {.length = message->header.length};
    if (frame.length > CAN_DATA_MAX) frame.length = CAN_DATA_MAX;
    memcpy(frame.data, message->data, sizeof frame.data);
    return frame;
}

static bool report(bool sent) {
    if (sent) (*module_CAN_message_tx_success)();
    return sent;
}

static void answer_poll(void) {
    uint8_t waiting = runtime_records_waiting();
    can_frame_t start = {.length = START_BYTES, .data = {CAN_TRACKING_KILOBOT_START, waiting}};
    if (!report(runtime_bus_send_to_host(&start))) return;
    _delay_ms(AFTER_START_MS);
    for (; waiting > 0; waiting--) {
        const CAN_message_t record = runtime_records_take();
        can_frame_t frame = frame_of(&record);
        if (!report(runtime_bus_send_to_host(&frame))) return;
        _delay_us(AFTER_RECORD_US);
    }
}

// Of the configuration that is complete.
static uint16_t configuration_crc(void) {
    uint16_t crc = 0xFFFF;
    if (runtime_transfer.config.next != TRANSFER_NOTHING_DUE) return crc;
    for (uint8_t i = 0; i < configuration_size; i++) crc = _crc_ccitt_update(crc, configuration[i]);
    return crc;
}

static void answer_health(uint8_t part) {
    const can_health_t can = runtime_bus_health();
    runtime_count_refused(can.missed);
    const struct kilogrid_can_to_host_t health = {
        .type = CAN_MODULE_DATA,
        .health_part = part,
        .state = runtime_module_state,
        .config_size = configuration_size,
        .config_crc = configuration_crc(),
        .lost_records = runtime_records_lost(),
        .refused_frames = runtime_frames_refused(),
        .transmit_errors = can.transmit_errors,
        .receive_errors = can.receive_errors,
        .uptime = runtime_clock_uptime(),
        .version = HEALTH_VERSION,
    };
    can_frame_t frame = {.length = CAN_DATA_MAX};
    kilogrid_can_to_host_pack(frame.data, &health, sizeof frame.data);
    (void)report(runtime_bus_send_to_host(&frame));
}

void runtime_answer_host(void) {
    if (runtime_orders.poll) {
        runtime_orders.poll = false;
        answer_poll();
    }
    for (uint8_t part = 0; runtime_orders.health >> part != 0; part++) {
        if ((runtime_orders.health >> part & 1) == 0) continue;
        cli();
        runtime_orders.health &= (uint8_t) ~(1 << part);
        sei();
        answer_health(part);
    }
}

uint8_t CAN_message_tx(CAN_message_t *message, kilogrid_address_t to) {
    can_frame_t frame = frame_of(message);
    const bool sent = report(runtime_bus_send(&frame, to.x, to.y, to.type));
    message->id = frame.id;
    return sent ? 1 : 0;
}

void CAN_send_broadcast_message(CAN_message_t *message) {
    broadcast = *message;
    broadcast_pending = true;
}

void runtime_send_broadcast(void) {
    if (!broadcast_pending) return;
    broadcast_pending = false;
    can_frame_t frame = frame_of(&broadcast);
    (void)report(runtime_bus_send(&frame, 0, 0, ADDR_BROADCAST));
}

kilogrid_address_t get_coord_from_CAN_ID(CAN_message_t *message) {
    uint8_t address[3];
    runtime_bus_address_of(message->id, address);
    return (kilogrid_address_t){address[0], address[1], (kilogrid_addressing_type_t)address[2]};
}
