#include "orders.h"

#include <string.h>

#include "../../../firmware/kilolib/include/message.h"
#include "../include/module_limits.h"

// Short names for the generated ones.
#define TO_MODULE(name) KILOGRID_CAN_TO_MODULE_TYPE_##name##_CHOICE

// One frame each.
#define HEALTH_PARTS 2
// A bound that was never written.
#define NO_BOUND 0xFF

void orders_init(orders_t *orders) {
    memset(orders, 0, sizeof *orders);
    transfer_init(&orders->transfer);
}

// Stops at its highest value: a wrap would hide losses.
void orders_count_refused(orders_t *orders, uint8_t frames) {
    const uint8_t room = (uint8_t)(UINT8_MAX - orders->refused);
    orders->refused = frames < room ? (uint8_t)(orders->refused + frames) : UINT8_MAX;
}

static order_t refuse(orders_t *orders) {
    orders_count_refused(orders, 1);
    return ORDER_REFUSED;
}

// RUN goes to the robots anew after every other state. A question that has not gone out by then is
// dropped, as one that comes while they run.
static void enter(orders_t *orders, module_state_t state) {
    if (state != STATE_RUNNING) orders->started = false;
    if (state == STATE_RUNNING || state == STATE_BOOT_LOADER) orders->ask = false;
    orders->state = (uint8_t)state;
}

// A configuration on its way ends with every order that is not about it.
static order_t enter_by_order(orders_t *orders, module_state_t state) {
    transfer_abandon_config(&orders->transfer);
    enter(orders, state);
    return ORDER_DONE;
}

bool orders_is_own_program(uint8_t type) {
    switch (type) {
    case TO_MODULE(MODULE_BOOTPAGE):
    case TO_MODULE(MODULE_BOOTPAGE_SIZE):
    case TO_MODULE(MODULE_BOOTPAGE_NUMBER):
    case TO_MODULE(OLD_MODULE_BOOTPAGE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_SIZE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_NUMBER): return true;
    default: return false;
    }
}

bool orders_leaves_boot_loader(uint8_t type) {
    switch (type) {
    case TO_MODULE(MODULE_IDLE):
    case TO_MODULE(OLD_MODULE_IDLE):
    case TO_MODULE(MODULE_SETUP):
    case TO_MODULE(MODULE_RUN): return true;
    default: return false;
    }
}

// BOOT begins a lap of pages by the first cell.
bool orders_forward(orders_t *orders, uint8_t x, uint8_t y, const calibration_area_t *area) {
    const uint8_t type = orders->transfer.ir.type;
    // An erased upper bound is above every place as it is.
    const bool outside = (area->x_min != NO_BOUND && x < area->x_min) || x > area->x_max ||
                         (area->y_min != NO_BOUND && y < area->y_min) || y > area->y_max;
    if (type == CALIB && area->restricted == 1 && outside) return false;
    if (type == BOOT) orders->page_cell = orders->page_received = 0;
    (void)enter_by_order(orders, STATE_SETUP_KILOBOTS);
    return true;
}

// An announcement behind some pages ends their lap, which need not have all of them. Where the lap
// has ended with its last page, there is nothing to end.
static order_t end_lap(orders_t *orders) {
    if (orders->page_received > 0) {
        orders->page_received = 0;
        orders->page_cell = (uint8_t)((orders->page_cell + 1) % N_CELLS);
    }
    return ORDER_DONE;
}

// The driver copies the configuration in the same interrupt, before the main loop sees the state.
static order_t transferred(orders_t *orders, transfer_event_t event) {
    switch (event) {
    case TRANSFER_CONFIG_BEGUN:
        enter(orders, STATE_WAITING_FOR_CONFIGURATION);
        return ORDER_CONFIG_SIZE;
    case TRANSFER_CONFIG_DONE:
        orders->set_up = false;
        enter(orders, STATE_SETUP);
        return ORDER_CONFIGURE;
    case TRANSFER_IR_DONE: return ORDER_FORWARD;
    case TRANSFER_PAGE_BEGUN: return enter_by_order(orders, STATE_WAITING_FOR_PAGE);
    case TRANSFER_PAGE_DONE:
        orders->page_received++;
        orders->page = true;
        enter(orders, STATE_BOOTLOADING_KILOBOTS);
        return ORDER_DONE;
    case TRANSFER_ANNOUNCED: return end_lap(orders);
    case TRANSFER_REFUSED: return refuse(orders);
    default: return ORDER_DONE;
    }
}

static order_t request_health(orders_t *orders, uint8_t part) {
    if (part >= HEALTH_PARTS) return refuse(orders);
    const uint8_t mask = (uint8_t)(1 << part);
    orders->health |= mask;
    return ORDER_DONE;
}

// While the robots run only the program speaks to them. A module that forwards a message stops
// that: it would not hear the answers.
static order_t ask_robots(orders_t *orders, const uint8_t *question) {
    if (orders->state == STATE_RUNNING) return ORDER_DONE;
    if (orders->state == STATE_SETUP_KILOBOTS) enter(orders, STATE_IDLE);
    memcpy(orders->question, question, sizeof orders->question);
    orders->ask = true;
    return ORDER_DONE;
}

// Frames that are too short for their type do not come here: transfer_receive() refuses them.
static order_t obey(orders_t *orders, const uint8_t *data) {
    switch (data[0]) {
    case TO_MODULE(FORWARD_IR_MESSAGE_STOP):
        memset(&orders->transfer.ir, 0, sizeof orders->transfer.ir);
        (void)enter_by_order(orders, STATE_IDLE);
        return ORDER_SILENCE;
    case TO_MODULE(MODULE_BOOT):
        (void)enter_by_order(orders, STATE_BOOT_LOADER);
        return ORDER_BOOT_LOADER;
    case TO_MODULE(MODULE_IDLE): return enter_by_order(orders, STATE_IDLE);
    case TO_MODULE(MODULE_SETUP): return enter_by_order(orders, STATE_SETUP);
    case TO_MODULE(MODULE_RUN): return enter_by_order(orders, STATE_RUNNING);
    case TO_MODULE(MODULE_PAUSE): return ORDER_DONE;
    case TO_MODULE(TRACKING_REQ): orders->poll = true; return ORDER_DONE;
    case TO_MODULE(MODULE_DATA): return request_health(orders, data[1]);
    case TO_MODULE(ROBOT_QUERY): return ask_robots(orders, data + 1);
    default: return ORDER_HAND_OVER;
    }
}

// Remote frames are no protocol of the grid's. Pages of the module's own program are the loader's.
order_t orders_receive(orders_t *orders, const uint8_t *data, uint8_t length, bool remote) {
    if (remote || length == 0) return refuse(orders);
    if (orders_is_own_program(data[0])) return ORDER_HAND_OVER;
    const transfer_event_t event = transfer_receive(&orders->transfer, data, length);
    return event == TRANSFER_NOT_MINE ? obey(orders, data) : transferred(orders, event);
}

void orders_begin(orders_t *orders) {
    if (orders->state == STATE_INIT) enter(orders, orders->autostart ? STATE_SETUP : STATE_IDLE);
}

// The flag is set first: a configuration that comes in during setup() calls for another one.
bool orders_begin_setup(orders_t *orders) {
    if (orders->set_up) return false;
    orders->set_up = true;
    return true;
}

void orders_end_setup(orders_t *orders) {
    if (orders->autostart && orders->state == STATE_SETUP) enter(orders, STATE_RUNNING);
}

// Taken by the main loop, which answers one request a pass.
bool orders_take_poll(orders_t *orders) {
    if (!orders->poll) return false;
    orders->poll = false;
    return true;
}

bool orders_take_health(orders_t *orders, uint8_t part) {
    const uint8_t mask = (uint8_t)(1 << part);
    if ((orders->health & mask) == 0) return false;
    orders->health &= (uint8_t)~mask;
    return true;
}
