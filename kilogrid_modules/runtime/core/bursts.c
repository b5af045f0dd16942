#include "bursts.h"

#include <string.h>

#include "light_patterns.h"

// The robots' boot loader counts a page in words of flash.
#define WORD_BYTES 2
#define ALL_CELLS ((1 << N_CELLS) - 1)

static const burst_light_t NO_CHANGE = {0, LED_OFF};

static burst_light_t all(color_t color) { return (burst_light_t){ALL_CELLS, (uint8_t)color}; }

// The data of the message that was forwarded last go out with RUN as well.
static void begin_rounds(burst_t *burst, const transfer_ir_t *ir, uint8_t type, uint8_t rounds) {
    memcpy(burst->message.data, ir->data, sizeof burst->message.data);
    burst->message.type = type;
    burst->frames = (uint8_t)(rounds * N_CELLS);
}

// Bytes of the message behind the question stay 0.
static void begin_question(burst_t *burst, orders_t *orders) {
    memcpy(burst->message.data, orders->question, sizeof orders->question);
    burst->message.type = BOOTPGM_QUERY;
    burst->frames = N_CELLS;
    orders->ask = false;
}

// The page is copied: the next one may come in while this one is being sent.
static void begin_page(burst_t *burst, orders_t *orders) {
    const transfer_page_t *kilo = &orders->transfer.kilo;
    memcpy(burst->bytes, kilo->data, sizeof burst->bytes);
    burst->cell = orders->page_cell;
    burst->pages = kilo->pages;
    burst->page = kilo->page;
    burst->is_first = orders->page_received == 1;
    burst->is_last = orders->page_received >= kilo->pages;
    burst->checked = kilo->checked;
    memcpy(burst->check, kilo->check, sizeof burst->check);
    burst->frames = (uint8_t)(TRANSFER_PAGE_CHUNKS + (burst->is_first ? 1 : 0));
    orders->page = false;
}

void burst_begin(burst_t *burst, orders_t *orders, job_t job) {
    const transfer_ir_t *ir = &orders->transfer.ir;
    memset(burst, 0, sizeof *burst);
    burst->job = (uint8_t)job;
    if (job == JOB_SEND_PAGE) {
        begin_page(burst, orders);
    } else if (job == JOB_START_ROBOTS) {
        begin_rounds(burst, ir, RUN, BURST_RUN_ROUNDS);
    } else if (job == JOB_ASK_ROBOTS) {
        begin_question(burst, orders);
    } else {
        begin_rounds(burst, ir, ir->type, 1);
    }
}

// A round that has begun is finished, so that no cell sends less than the others.
static bool is_over(const burst_t *burst, const orders_t *orders) {
    const bool between_rounds = burst->sent % N_CELLS == 0;
    const bool stopped = burst->job == JOB_START_ROBOTS && orders->state != STATE_RUNNING;
    return burst->sent == burst->frames || (stopped && between_rounds);
}

// The end of a lap darkens all cells: the light of its last page would not be seen.
static burst_light_t light_of_page(const burst_t *burst, bool over) {
    if (!over) return burst->is_first && burst->sent == 1 ? all(LED_OFF) : NO_CHANGE;
    if (burst->is_last) return all(LED_OFF);
    return (burst_light_t){(uint8_t)(1 << burst->cell), (uint8_t)pattern_page_color(burst->page)};
}

burst_light_t burst_light(const burst_t *burst, const orders_t *orders) {
    const bool over = is_over(burst, orders);
    if (burst->job == JOB_SEND_PAGE) return light_of_page(burst, over);
    if (burst->job == JOB_START_ROBOTS) return burst->sent == 0 ? all(MAGENTA) : NO_CHANGE;
    if (burst->job == JOB_ASK_ROBOTS) return NO_CHANGE;
    if (!over || orders->state != STATE_SETUP_KILOBOTS) return NO_CHANGE;
    return all(pattern_command_color(burst->message.type));
}

// Announces the program, with what it is checked by if the host has given that (boot_loaders.md
// 5.1).
static void announce(const burst_t *burst, message_t *message) {
    message->type = BOOTPGM_SIZE;
    message->data[0] = burst->pages;
    if (!burst->checked) return;
    message->data[1] = 'K';
    message->data[2] = 'T';
    memcpy(message->data + 3, burst->check, sizeof burst->check);
}

// The number of pages, then the page chunk by chunk.
static void next_of_page(const burst_t *burst, message_t *message) {
    memset(message, 0, sizeof *message);
    if (burst->is_first && burst->sent == 0) {
        announce(burst, message);
        return;
    }
    const uint8_t chunk = (uint8_t)(burst->sent - (burst->is_first ? 1 : 0));
    const uint8_t at = (uint8_t)(chunk * TRANSFER_CHUNK_BYTES);
    const uint8_t left = (uint8_t)(TRANSFER_PAGE_BYTES - at);
    message->type = BOOTPGM_PAGE;
    message->data[0] = burst->page;
    message->data[1] = at / WORD_BYTES;
    memcpy(message->data + 2, burst->bytes + at,
           left < TRANSFER_CHUNK_BYTES ? left : TRANSFER_CHUNK_BYTES);
}

bool burst_next(burst_t *burst, const orders_t *orders, burst_frame_t *frame) {
    if (is_over(burst, orders)) return false;
    if (burst->job == JOB_SEND_PAGE) {
        next_of_page(burst, &frame->message);
        frame->cell = burst->cell;
    } else {
        frame->message = burst->message;
        frame->cell = burst->sent % N_CELLS;
    }
    burst->sent++;
    return true;
}

bool burst_pauses(const burst_t *burst) {
    return burst->job == JOB_SEND_PAGE && burst->sent < burst->frames;
}

// A page that came in during the last one of a lap is forgotten with the count: the host sends the
// laps without end.
void burst_end(burst_t *burst, orders_t *orders) {
    if (burst->job == JOB_START_ROBOTS) orders->started = orders->state == STATE_RUNNING;
    if (burst->job == JOB_SEND_PAGE && burst->is_last) {
        orders->page_received = 0;
        orders->page_cell = (uint8_t)((burst->cell + 1) % N_CELLS);
    }
    burst->job = JOB_NONE;
}
