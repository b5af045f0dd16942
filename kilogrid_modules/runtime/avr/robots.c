#include "robots.h"

#include <string.h>
#include <util/atomic.h>

#include "infrared.h"
#include "module.h"
#include "moduleIR.h"
#include "moduleLED.h"
#include "states.h"

#define RUNS_PER_CELL 10
#define WORD_BYTES 2

static message_t message_to_repeat(void) {
    message_t message;
    memset(&message, 0, sizeof message);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        memcpy(message.data, runtime_transfer.ir.data, sizeof message.data);
        message.type = runtime_transfer.ir.type;
    }
    return message;
}

static color_t color_of(uint8_t type) {
    switch (type) {
    case RESET: return GREEN;
    case BOOT: return BLUE;
    case BOOTPGM_PAGE:
    case BOOTPGM_SIZE: return CYAN;
    case SLEEP: return WHITE;
    case RUN: return MAGENTA;
    case CHARGE: return RED;
    case VOLTAGE:
    case CALIB:
    case GO_STRAIGHT:
    case TURN_LEFT:
    case TURN_RIGHT: return YELLOW;
    default: return LED_OFF;
    }
}

static void send_by_all(message_t *message) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) send_IR_message(message, (cell_num_t)cell);
}

void runtime_repeat_message(void) {
    message_t message = message_to_repeat();
    send_by_all(&message);
    if (runtime_module_state == STATE_SETUP_KILOBOTS) set_all_LEDs(color_of(message.type));
}

void runtime_start_robots(void) {
    message_t message = message_to_repeat();
    message.type = RUN;
    set_all_LEDs(MAGENTA);
    for (uint8_t i = 0; i < RUNS_PER_CELL && runtime_module_state == STATE_RUNNING; i++) {
        wdt_reset();
        send_by_all(&message);
    }
}

static void send_size(cell_num_t cell, uint8_t pages) {
    message_t message;
    memset(&message, 0, sizeof message);
    message.type = BOOTPGM_SIZE;
    message.data[0] = pages;
    send_IR_message(&message, cell);
    set_all_LEDs(LED_OFF);
}

static void send_words(cell_num_t cell, uint8_t page, const uint8_t *bytes) {
    message_t message;
    for (uint8_t at = 0; at < TRANSFER_PAGE_BYTES; at = (uint8_t)(at + TRANSFER_CHUNK_BYTES)) {
        const uint8_t left = (uint8_t)(TRANSFER_PAGE_BYTES - at);
        memset(&message, 0, sizeof message);
        message.type = BOOTPGM_PAGE;
        message.data[0] = page;
        message.data[1] = at / WORD_BYTES;
        memcpy(message.data + 2, bytes + at,
               left < TRANSFER_CHUNK_BYTES ? left : TRANSFER_CHUNK_BYTES);
        send_IR_message(&message, cell);
    }
}

// A copy: the next page may come in while this one goes out. After a whole program the next cell
// has its turn, so that four rounds reach the robots of all.
void runtime_send_page(void) {
    uint8_t bytes[TRANSFER_PAGE_BYTES];
    uint8_t page = 0, pages = 0, received = 0;
    const cell_num_t cell = (cell_num_t)runtime_orders.page_cell;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        memcpy(bytes, runtime_transfer.kilo.data, sizeof bytes);
        page = runtime_transfer.kilo.page;
        pages = runtime_transfer.kilo.pages;
        received = runtime_orders.pages_received;
        runtime_orders.page = false;
    }
    if (received == 1) send_size(cell, pages);
    send_words(cell, page, bytes);
    set_LED(cell, page % 2 == 0 ? BLUE : GREEN);
    if (received < pages) return;
    runtime_orders.pages_received = 0;
    runtime_orders.page_cell = (uint8_t)((cell + 1) % N_CELLS);
    set_all_LEDs(LED_OFF);
}
