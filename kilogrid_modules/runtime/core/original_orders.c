#include "original_orders.h"

#include <string.h>

// Short names for the generated ones.
#define TO_MODULE(name) KILOGRID_CAN_TO_MODULE_TYPE_##name##_CHOICE
// Places in a frame, and the part of an announcement that the original knows.
enum { AT_TYPE = 0, AT_SEQUENCE = 1, AT_SIZE_PART = 1 };
#define DATA_BYTES KILOGRID_CAN_TO_MODULE_LENGTH
#define PAGES_PART 0

static bool is_ours(uint8_t type) {
    return type == TO_MODULE(MODULE_DATA) || type == TO_MODULE(ROBOT_QUERY);
}

// Whatever its part says, it is a number of pages, and the lap goes on.
static order_t take_announcement(orders_t *orders, const uint8_t *data, uint8_t length) {
    uint8_t frame[DATA_BYTES] = {0};
    memcpy(frame, data, length < DATA_BYTES ? length : DATA_BYTES);
    frame[AT_SIZE_PART] = PAGES_PART;
    const uint8_t received = orders->page_received, cell = orders->page_cell;
    const order_t order = orders_receive(orders, frame, length, false);
    orders->page_received = received;
    orders->page_cell = cell;
    return order;
}

order_t original_receive(orders_t *orders, const uint8_t *data, uint8_t length, bool remote) {
    if (remote || length == 0) return orders_receive(orders, data, length, remote);
    if (is_ours(data[AT_TYPE])) return ORDER_HAND_OVER;
    if (data[AT_TYPE] == TO_MODULE(KILO_BOOTPAGE_SIZE))
        return take_announcement(orders, data, length);
    transfer_page_t *page = &orders->transfer.kilo;
    // Behind a lost first chunk; a frame that is too short has no number.
    const bool second = length > AT_SEQUENCE && data[AT_SEQUENCE] == 1;
    if (data[AT_TYPE] == TO_MODULE(KILO_BOOTPAGE) && second && page->next == 0) page->next = 1;
    return orders_receive(orders, data, length, remote);
}
