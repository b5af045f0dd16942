/// Orders as tests of the module's core give them.
#ifndef MODULE_RUNTIME_TESTS_CORE_SUPPORT_H
#define MODULE_RUNTIME_TESTS_CORE_SUPPORT_H

#include <stdlib.h>
#include <string.h>

#include "../firmware/support.h"
#include "runtime/core/orders.h"

// Types of CAN frames, as the specification numbers them (hardware.md 3.2).
enum {
    FORWARD = 0x01,
    STOP = 0x02,
    KILO_PAGE = 0x03,
    KILO_PAGES = 0x04,
    KILO_NUMBER = 0x05,
    TO_LOADER = 0x06,
    OWN_PAGE = 0x07,
    OWN_PAGES = 0x08,
    OWN_NUMBER = 0x09,
    GO_IDLE = 0x0B,
    GO_SETUP = 0x0C,
    GO_RUN = 0x0D,
    PAUSE = 0x0E,
    CONFIG_SIZE = 0x0F,
    CONFIG = 0x10,
    HEALTH = 0x13,
    POLL = 0x15,
    ASK = 0x19,
    OLD = 0x9F,  // added to the types of the boot loader by the original dispatcher
};

static const calibration_area_t EVERYWHERE = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF};

static inline orders_t fresh_orders(void) {
    orders_t orders;
    memset(&orders, 0xA5, sizeof orders);
    orders_init(&orders);
    return orders;
}

static inline order_t give(orders_t *orders, uint8_t type, uint8_t number, uint8_t value) {
    const uint8_t data[8] = {type, number, value};
    return orders_receive(orders, data, sizeof data, false);
}

/// A message of `type` to be forwarded, whose data bytes are 1 to 9.
static inline order_t give_message(orders_t *orders, uint8_t type) {
    const uint8_t first[8] = {FORWARD, 0, 1, 2, 3, 4, 5, 6},
                  second[8] = {FORWARD, 1, 7, 8, 9, type};
    assert_int_equal(orders_receive(orders, first, 8, false), ORDER_DONE);
    return orders_receive(orders, second, 8, false);
}

static inline void forward(orders_t *orders, uint8_t type) {
    assert_int_equal(give_message(orders, type), ORDER_FORWARD);
    assert_true(orders_forward(orders, 0, 0, &EVERYWHERE));
}

/// A question for all robots' vitals.
static inline order_t give_question(orders_t *orders) {
    const uint8_t data[8] = {ASK, 0xE1, 4, 7, 0xFF, 0xFF};
    return orders_receive(orders, data, 6, false);
}

/// Page `page` of the robots' program; its byte i is page + i.
static inline void give_page(orders_t *orders, uint8_t page) {
    assert_int_equal(give(orders, KILO_NUMBER, 0, page), ORDER_DONE);
    for (uint8_t chunk = 0; chunk < 22; chunk++) {
        uint8_t data[8] = {KILO_PAGE, chunk};
        for (uint8_t i = 0; i < 6; i++) data[2 + i] = (uint8_t)(page + 6 * chunk + i);
        assert_int_equal(orders_receive(orders, data, 8, false), ORDER_DONE);
    }
}

#endif
