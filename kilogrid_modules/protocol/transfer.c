#include "transfer.h"

#include <string.h>

#include "address.h"
#include "kilogrid_can.h"

// Short names for the generated ones.
#define TO_MODULE(name) KILOGRID_CAN_TO_MODULE_TYPE_##name##_CHOICE
typedef struct kilogrid_can_to_module_t frame_t;

// The part of an infrared message that the first of its two frames holds.
#define IR_FIRST_BYTES TRANSFER_CHUNK_BYTES

// Place of ImageCrc and ImageId, side by side.
#define CHECK_AT 2

// Counters of what was refused stop at their highest value, so that a wrap never hides a loss.
static uint16_t one_more(uint16_t count) {
    return count < UINT16_MAX ? (uint16_t)(count + 1) : count;
}

static transfer_event_t too_short(transfer_t *transfer) {
    transfer->dropped.too_short = one_more(transfer->dropped.too_short);
    return TRANSFER_REFUSED;
}

static transfer_event_t out_of_range(transfer_t *transfer) {
    transfer->dropped.out_of_range = one_more(transfer->dropped.out_of_range);
    return TRANSFER_REFUSED;
}

static transfer_event_t out_of_order(transfer_t *transfer) {
    transfer->dropped.out_of_order = one_more(transfer->dropped.out_of_order);
    return TRANSFER_REFUSED;
}

void transfer_init(transfer_t *transfer) {
    memset(transfer, 0, sizeof *transfer);
    transfer->config.next = TRANSFER_NOTHING_DUE;
    transfer->kilo.next = TRANSFER_NOTHING_DUE;
    transfer->own.next = TRANSFER_NOTHING_DUE;
}

void transfer_abandon_config(transfer_t *transfer) { transfer->config.next = TRANSFER_NOTHING_DUE; }

// Copies chunk number `chunk` to its place in `data`, which has `size` bytes, chunk * 6 of them
// before it. True if it was the last one.
static bool place_chunk(uint8_t *data, uint8_t size, uint8_t chunk, const frame_t *frame) {
    const uint8_t bytes[TRANSFER_CHUNK_BYTES] = {frame->byte0, frame->byte1, frame->byte2,
                                                 frame->byte3, frame->byte4, frame->byte5};
    const uint8_t begin = (uint8_t)(chunk * TRANSFER_CHUNK_BYTES);
    const uint8_t left = (uint8_t)(size - begin);
    const bool is_last = left <= TRANSFER_CHUNK_BYTES;
    memcpy(data + begin, bytes, is_last ? left : TRANSFER_CHUNK_BYTES);
    return is_last;
}

static transfer_event_t config_size(transfer_t *transfer, const frame_t *frame) {
    if (frame->config_size == 0 || frame->config_size > TRANSFER_CONFIG_BYTES) {
        // The chunks behind it are not for an earlier one either.
        transfer_abandon_config(transfer);
        return out_of_range(transfer);
    }
    transfer->config.size = frame->config_size;
    transfer->config.next = 0;
    return TRANSFER_CONFIG_BEGUN;
}

// Chunks come in order or not at all: a gap would leave bytes of an earlier configuration.
static transfer_event_t config_chunk(transfer_t *transfer, const frame_t *frame) {
    transfer_config_t *config = &transfer->config;
    if (frame->sequence >= TRANSFER_CONFIG_BYTES / TRANSFER_CHUNK_BYTES)
        return out_of_range(transfer);
    if (config->next == TRANSFER_NOTHING_DUE || frame->sequence != config->next) {
        config->next = TRANSFER_NOTHING_DUE;
        return out_of_order(transfer);
    }
    if (!place_chunk(config->data, config->size, config->next, frame)) {
        config->next++;
        return TRANSFER_GOES_ON;
    }
    config->next = TRANSFER_NOTHING_DUE;
    return TRANSFER_CONFIG_DONE;
}

// Part 1 counts only right behind a part 0, whose bytes would be another message's otherwise.
static transfer_event_t ir_part(transfer_t *transfer, const frame_t *frame) {
    transfer_ir_t *ir = &transfer->ir;
    const uint8_t first[IR_FIRST_BYTES] = {frame->ir_data0, frame->ir_data1, frame->ir_data2,
                                           frame->ir_data3, frame->ir_data4, frame->ir_data5};
    const uint8_t second[] = {frame->ir_data6, frame->ir_data7, frame->ir_data8};
    if (frame->ir_part > 1) return out_of_range(transfer);
    if (frame->ir_part == 0) {
        memcpy(ir->data, first, sizeof first);
        ir->has_first = true;
        return TRANSFER_GOES_ON;
    }
    if (!ir->has_first) return out_of_order(transfer);
    memcpy(ir->data + IR_FIRST_BYTES, second, sizeof second);
    ir->type = frame->ir_type;
    ir->has_first = false;
    return TRANSFER_IR_DONE;
}

// The check is kept as it came, and goes to robots so. It holds for the next number of pages alone:
// what an original sender announces later has none.
static transfer_event_t program_check(transfer_page_t *program, const uint8_t *check) {
    memcpy(program->check, check, sizeof program->check);
    program->check_due = true;
    return TRANSFER_GOES_ON;
}

// The number of pages comes first; then pages in any order, each in order of its chunks.
static transfer_event_t page_count(transfer_t *transfer, transfer_page_t *program,
                                   const frame_t *frame) {
    if (frame->pages == 0 || frame->pages > TRANSFER_PAGES) return out_of_range(transfer);
    program->pages = frame->pages;
    program->checked = program->check_due;
    program->check_due = false;
    program->next = TRANSFER_NOTHING_DUE;
    return TRANSFER_ANNOUNCED;
}

// `data` and `length` are the frame's: its part 1 is longer than its type says.
static transfer_event_t announcement(transfer_t *transfer, transfer_page_t *program,
                                     const frame_t *frame, const uint8_t *data, uint8_t length) {
    if (frame->size_part == 0) return page_count(transfer, program, frame);
    if (frame->size_part > 1) return out_of_range(transfer);
    if (length < KILOGRID_CAN_TO_MODULE_LENGTH) return too_short(transfer);
    return program_check(program, data + CHECK_AT);
}

static transfer_event_t page_number(transfer_t *transfer, transfer_page_t *program,
                                    const frame_t *frame) {
    if (frame->page >= program->pages) {
        // As above, for the page before.
        program->next = TRANSFER_NOTHING_DUE;
        return out_of_range(transfer);
    }
    program->page = frame->page;
    program->next = 0;
    return TRANSFER_PAGE_BEGUN;
}

static transfer_event_t page_chunk(transfer_t *transfer, transfer_page_t *program,
                                   const frame_t *frame) {
    if (frame->sequence >= TRANSFER_PAGE_CHUNKS) return out_of_range(transfer);
    // Chunk 0 twice is harmless. Later in a page it is the next page's, whose number was lost.
    if (program->next == 1 && frame->sequence == 0) program->next = 0;
    if (program->next == TRANSFER_NOTHING_DUE || frame->sequence != program->next) {
        program->next = TRANSFER_NOTHING_DUE;
        return out_of_order(transfer);
    }
    if (!place_chunk(program->data, TRANSFER_PAGE_BYTES, program->next, frame)) {
        program->next++;
        return TRANSFER_GOES_ON;
    }
    program->next = TRANSFER_NOTHING_DUE;
    return TRANSFER_PAGE_DONE;
}

// One bit a page of the module's own program.
static uint8_t bit_of(uint8_t page) { return (uint8_t)(1u << (page & 7)); }

// Whether a page of the module's own program is complete.
static bool has_own_page(const transfer_t *transfer, uint8_t page) {
    return (transfer->own_pages[page >> 3] & bit_of(page)) != 0;
}

// The robots' programs come round and round; the module's own page counts once.
static transfer_event_t own_page_chunk(transfer_t *transfer, const frame_t *frame) {
    const transfer_event_t event = page_chunk(transfer, &transfer->own, frame);
    if (event != TRANSFER_PAGE_DONE) return event;
    const uint8_t page = transfer->own.page;
    if (has_own_page(transfer, page)) return TRANSFER_GOES_ON;
    transfer->own_pages[page >> 3] |= bit_of(page);
    return TRANSFER_OWN_PAGE_DONE;
}

uint8_t transfer_own_pages_missing(const transfer_t *transfer) {
    uint8_t missing = 0;
    for (uint8_t page = 0; page < transfer->own.pages; page++)
        if (!has_own_page(transfer, page)) missing++;
    return missing;
}

transfer_event_t transfer_receive(transfer_t *transfer, const uint8_t *data, uint8_t length) {
    // The generated code unpacks whole frames: what a short one lacks reads 0.
    uint8_t bytes[KILOGRID_CAN_TO_MODULE_LENGTH] = {0};
    frame_t frame;
    if (length > sizeof bytes) length = sizeof bytes;
    if (length == 0) return too_short(transfer);
    memcpy(bytes, data, length);
    memset(&frame, 0, sizeof frame);
    (void)kilogrid_can_to_module_unpack(&frame, bytes, sizeof bytes);
    if (length < kilogrid_least_dlc_to_module(frame.type)) return too_short(transfer);
    switch (frame.type) {
    case TO_MODULE(MODULE_CONFIG_SIZE): return config_size(transfer, &frame);
    case TO_MODULE(MODULE_CONFIG_TRANSFER): return config_chunk(transfer, &frame);
    case TO_MODULE(FORWARD_IR_MESSAGE): return ir_part(transfer, &frame);
    case TO_MODULE(KILO_BOOTPAGE_SIZE):
        return announcement(transfer, &transfer->kilo, &frame, bytes, length);
    case TO_MODULE(KILO_BOOTPAGE_NUMBER): return page_number(transfer, &transfer->kilo, &frame);
    case TO_MODULE(KILO_BOOTPAGE): return page_chunk(transfer, &transfer->kilo, &frame);
    case TO_MODULE(MODULE_BOOTPAGE_SIZE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_SIZE):
        return announcement(transfer, &transfer->own, &frame, bytes, length);
    case TO_MODULE(MODULE_BOOTPAGE_NUMBER):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_NUMBER): {
        const transfer_event_t event = page_number(transfer, &transfer->own, &frame);
        return event == TRANSFER_PAGE_BEGUN ? TRANSFER_GOES_ON : event;
    }
    case TO_MODULE(MODULE_BOOTPAGE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE): return own_page_chunk(transfer, &frame);
    default: return TRANSFER_NOT_MINE;
    }
}
