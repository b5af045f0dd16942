#include "answers.h"

#include <string.h>

#include "address.h"

// Short names for the generated ones.
#define TO_HOST(name) KILOGRID_CAN_TO_HOST_TYPE_##name##_CHOICE

// Version of the layout in kilogrid.dbc, not of the module.
#define HEALTH_VERSION 1

uint8_t answers_poll(uint8_t waiting, uint8_t data[ANSWERS_BYTES]) {
    memset(data, 0, ANSWERS_BYTES);
    data[0] = TO_HOST(TRACKING_KILOBOT_START);
    data[1] = waiting;
    return kilogrid_dlc_to_host(data[0]);
}

uint8_t answers_health(const orders_t *orders, uint8_t part, const health_facts_t *facts,
                       uint8_t data[ANSWERS_BYTES]) {
    const struct kilogrid_can_to_host_t health = {
        .type = TO_HOST(MODULE_DATA),
        .health_part = part,
        .state = orders->state,
        .config_size = facts->config_size,
        .config_crc = facts->config_crc,
        .lost_records = facts->lost_records,
        .refused_frames = orders->refused,
        .transmit_errors = facts->transmit_errors,
        .receive_errors = facts->receive_errors,
        .uptime = facts->uptime_s,
        .version = HEALTH_VERSION,
    };
    (void)kilogrid_can_to_host_pack(data, &health, ANSWERS_BYTES);
    return kilogrid_dlc_to_host(health.type);
}

// While chunks come in, the size is the new one and the bytes are the old ones.
uint8_t answers_configured(const orders_t *orders, uint8_t config_size) {
    return orders->transfer.config.next == TRANSFER_NOTHING_DUE ? config_size : 0;
}
