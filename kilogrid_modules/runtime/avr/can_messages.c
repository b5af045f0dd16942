#include "can_messages.h"

#include <string.h>
#include <util/atomic.h>
#include <util/crc16.h>

#include "../core/answers.h"
#include "bus.h"
#include "clock.h"
#include "commands.h"
#include "module.h"
#include "records.h"

static CAN_message_t broadcast;
static volatile bool broadcast_pending;

static void ignore_rx(CAN_message_t *message) { (void)message; }
static void ignore_tx_success(void) {}

CAN_message_rx_t module_CAN_message_rx = ignore_rx;
CAN_message_tx_success_t module_CAN_message_tx_success = ignore_tx_success;

// A program may leave anything in the length.
static can_frame_t frame_of(const CAN_message_t *message) {
    can_frame_t frame = {.length = message->header.length};
    if (frame.length > CAN_DATA_MAX) frame.length = CAN_DATA_MAX;
    memcpy(frame.data, message->data, sizeof frame.data);
    return frame;
}

// The program's callback comes for every frame that went out, ours included.
static bool report(bool sent) {
    if (sent) (*module_CAN_message_tx_success)();
    return sent;
}

// The host gets time to take the frames in. A record that does not get through is lost.
static void answer_poll(void) {
    uint8_t waiting = runtime_records.used;
    can_frame_t start = {0};
    start.length = answers_poll(waiting, start.data);
    if (!report(runtime_bus_send_to_host(&start))) return;
    _delay_us(ANSWERS_AFTER_START_US);
    for (; waiting > 0; waiting--) {
        const CAN_message_t record = runtime_records_take();
        can_frame_t frame = frame_of(&record);
        if (!report(runtime_bus_send_to_host(&frame))) return;
        _delay_us(ANSWERS_AFTER_RECORD_US);
    }
}

// CRC-16/MCRF4XX, as of messages (hardware.md 1.5).
static uint16_t configuration_crc(void) {
    uint16_t crc = 0xFFFF;
    const uint8_t bytes = answers_configured(&runtime_orders, configuration_size);
    for (uint8_t i = 0; i < bytes; i++) crc = _crc_ccitt_update(crc, configuration[i]);
    return crc;
}

static void answer_health(uint8_t part) {
    const can_health_t can = runtime_bus_health();
    orders_count_refused(&runtime_orders, can.missed);
    const health_facts_t facts = {
        .config_crc = configuration_crc(),
        .uptime_s = runtime_clock_uptime(),
        .config_size = configuration_size,
        .lost_records = runtime_records.lost,
        .transmit_errors = can.transmit_errors,
        .receive_errors = can.receive_errors,
    };
    can_frame_t frame = {0};
    frame.length = answers_health(&runtime_orders, part, &facts, frame.data);
    (void)report(runtime_bus_send_to_host(&frame));
}

static void forward_reports(void) {
    can_frame_t frame = {.length = ROBOT_REPORT_BYTES};
    for (;;) {
        bool due = false;
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
            due = robot_reports_take(&runtime_orders.reports, frame.data);
        }
        if (!due) return;
        (void)report(runtime_bus_send_to_host(&frame));
    }
}

// An interrupt may set further bits meanwhile.
void runtime_answer_host(void) {
    forward_reports();
    if (orders_take_poll(&runtime_orders)) answer_poll();
    for (uint8_t part = 0; runtime_orders.health >> part != 0; part++) {
        bool due = false;
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { due = orders_take_health(&runtime_orders, part); }
        if (due) answer_health(part);
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

// The flag goes first: the program may leave the next frame from an interrupt.
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
