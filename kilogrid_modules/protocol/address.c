#include "address.h"

#include "kilogrid_can.h"

// An identifier: y + 1, x + 1, and whether it is for the host (hardware.md 3.2).
#define ID_BITS 11
#define FIELD_MASK 0x1F
#define X_SHIFT 1
#define Y_SHIFT 6
#define TO_HOST 0x001

static bool is_coordinate(uint8_t value) { return value <= KILOGRID_COORDINATE_MAX; }

// The field of a coordinate, in its place.
static uint16_t x_field(uint8_t x) { return (uint16_t)((x + 1u) << X_SHIFT); }
static uint16_t y_field(uint8_t y) { return (uint16_t)((y + 1u) << Y_SHIFT); }

uint16_t kilogrid_id(kilogrid_address_t address) {
    const bool x_fits = is_coordinate(address.x), y_fits = is_coordinate(address.y);
    switch (address.type) {
    case ADDR_BROADCAST: return 0;
    case ADDR_ROW: return y_fits ? y_field(address.y) : KILOGRID_NO_ID;
    case ADDR_COLUMN: return x_fits ? x_field(address.x) : KILOGRID_NO_ID;
    case ADDR_INDIVIDUAL:
    case ADDR_DISPATCHER:
        if (!x_fits || !y_fits) return KILOGRID_NO_ID;
        return (uint16_t)(y_field(address.y) | x_field(address.x) |
                          (address.type == ADDR_DISPATCHER ? TO_HOST : 0));
    default: return KILOGRID_NO_ID;
    }
}

bool kilogrid_address(uint16_t id, kilogrid_address_t *address) {
    const uint8_t x = (uint8_t)(id >> X_SHIFT & FIELD_MASK);
    const uint8_t y = (uint8_t)(id >> Y_SHIFT & FIELD_MASK);
    const bool to_host = (id & TO_HOST) != 0;
    if (id >> ID_BITS != 0 || (to_host && (x == 0 || y == 0))) return false;
    // A field of 0 is no coordinate: the one that is left out reads 0.
    address->x = x == 0 ? 0 : (uint8_t)(x - 1);
    address->y = y == 0 ? 0 : (uint8_t)(y - 1);
    if (to_host)
        address->type = ADDR_DISPATCHER;
    else if (x == 0)
        address->type = y == 0 ? ADDR_BROADCAST : ADDR_ROW;
    else
        address->type = y == 0 ? ADDR_COLUMN : ADDR_INDIVIDUAL;
    return true;
}

bool kilogrid_filters(uint8_t x, uint8_t y, uint16_t ids[KILOGRID_FILTERS]) {
    if (!is_coordinate(x) || !is_coordinate(y)) return false;
    ids[ADDR_BROADCAST] = 0;
    ids[ADDR_ROW] = y_field(y);
    ids[ADDR_COLUMN] = x_field(x);
    ids[ADDR_INDIVIDUAL] = (uint16_t)(ids[ADDR_ROW] | ids[ADDR_COLUMN]);
    return true;
}

// Data bytes sent: eight, as the original's host does, but for the short requests.
uint8_t kilogrid_dlc_to_module(uint8_t type) {
    switch (type) {
    case KILOGRID_CAN_TO_MODULE_TYPE_TRACKING_REQ_CHOICE: return 1;
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_DATA_CHOICE: return 2;
    default: return KILOGRID_CAN_TO_MODULE_LENGTH;
    }
}

uint8_t kilogrid_dlc_to_host(uint8_t type) {
    return type == KILOGRID_CAN_TO_HOST_TYPE_TRACKING_KILOBOT_START_CHOICE
               ? 2
               : KILOGRID_CAN_TO_HOST_LENGTH;
}

// Data bytes that a module needs to act: every one that its handler reads.
uint8_t kilogrid_least_dlc_to_module(uint8_t type) {
    switch (type) {
    case KILOGRID_CAN_TO_MODULE_TYPE_FORWARD_IR_MESSAGE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_KILO_BOOTPAGE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_BOOTPAGE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_OLD_MODULE_BOOTPAGE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_CONFIG_TRANSFER_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_BOOTPAGE_CRC_CHOICE:
        return KILOGRID_CAN_TO_MODULE_LENGTH;
    case KILOGRID_CAN_TO_MODULE_TYPE_KILO_BOOTPAGE_SIZE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_KILO_BOOTPAGE_NUMBER_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_BOOTPAGE_SIZE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_BOOTPAGE_NUMBER_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_OLD_MODULE_BOOTPAGE_SIZE_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_OLD_MODULE_BOOTPAGE_NUMBER_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_CONFIG_SIZE_CHOICE: return 3;
    case KILOGRID_CAN_TO_MODULE_TYPE_ROBOT_QUERY_CHOICE: return 6;
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_BOOT_QUERY_CHOICE:
    case KILOGRID_CAN_TO_MODULE_TYPE_MODULE_DATA_CHOICE: return 2;
    default: return 1;
    }
}

uint8_t kilogrid_least_dlc_to_host(uint8_t type) {
    switch (type) {
    case KILOGRID_CAN_TO_HOST_TYPE_TRACKING_KILOBOT_CHOICE:
    case KILOGRID_CAN_TO_HOST_TYPE_MODULE_DATA_CHOICE:
    case KILOGRID_CAN_TO_HOST_TYPE_MODULE_BOOT_REPORT_CHOICE:
    case KILOGRID_CAN_TO_HOST_TYPE_ROBOT_REPORT_CHOICE:
    case KILOGRID_CAN_TO_HOST_TYPE_HOST_PRESENT_CHOICE: return KILOGRID_CAN_TO_HOST_LENGTH;
    case KILOGRID_CAN_TO_HOST_TYPE_TRACKING_KILOBOT_START_CHOICE: return 2;
    default: return 1;
    }
}
