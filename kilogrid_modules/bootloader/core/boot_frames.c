#include "boot_frames.h"

#include <string.h>

#include "kilogrid_can.h"

// Short names for the generated ones.
#define TO_MODULE(name) KILOGRID_CAN_TO_MODULE_TYPE_##name##_CHOICE
#define TO_HOST(name) KILOGRID_CAN_TO_HOST_TYPE_##name##_CHOICE

// Places in the data of frames (wire.md), and the bytes that a frame has at least.
enum { TYPE = 0, SEQUENCE = 1, BYTES = 2 };
enum { PART = 1, PAGES = 2, CHECK = 2, SIZE_LENGTH = 3 };
enum { NUMBER = 2, NUMBER_LENGTH = 3 };
enum { FIRST = 1, QUERY_LENGTH = 2, CRCS = 2, REPORT = 2 };
enum { PART_PAGES = 0, PART_CHECK = 1 };

#define CRCS_OF_FRAME 3

static uint16_t word_at(const uint8_t *data) { return (uint16_t)(data[0] | data[1] << 8); }

// An image of which only the number of pages is known.
static __attribute__((noinline)) void expect_no_check(boot_frames_t *frames) {
    memset(&frames->next, 0xFF, sizeof frames->next);
    frames->next.checked = 0;
}

void boot_frames_init(boot_frames_t *frames) {
    expect_no_check(frames);
    frames->page = BOOT_NO_PAGE;
    frames->asked = BOOT_NOTHING_ASKED;
}

// CRC and id lie side by side, as in an image_t.
#define CHECK_BYTES (sizeof(uint16_t) + IMAGE_ID_BYTES)

// A check holds for the next number of pages alone: what another sender announces has none.
static void take_size(boot_frames_t *frames, image_store_t *store, const uint8_t *data,
                      uint8_t length) {
    image_t *next = &frames->next;
    if (data[PART] == PART_PAGES) {
        next->pages = data[PAGES];
        image_store_announce(store, next);
        expect_no_check(frames);
    } else if (data[PART] == PART_CHECK && length == BOOT_FRAME_BYTES) {
        next->checked = 1;
        memcpy(&next->crc, data + CHECK, CHECK_BYTES);
    }
}

static void take_fragment(boot_frames_t *frames, image_store_t *store, const uint8_t *data) {
    const uint8_t fragment = data[SEQUENCE];
    if (fragment < frames->fragment) frames->page = BOOT_NO_PAGE;
    if (frames->page == BOOT_NO_PAGE) return;
    frames->fragment = (uint8_t)(fragment + 1);
    image_store_fragment(store, frames->page, fragment, data + BYTES);
}

static void check_pages(image_store_t *store, const uint8_t *data) {
    const uint8_t *crc = data + CRCS;
    if (data[FIRST] >= BOOT_PAGES) return;
    for (uint8_t i = 0; i < CRCS_OF_FRAME; i++, crc += 2)
        image_store_check_page(store, (uint8_t)(data[FIRST] + i), word_at(crc));
}

bool boot_frames_take(boot_frames_t *frames, image_store_t *store, const uint8_t *data,
                      uint8_t length) {
    if (length == 0) return false;
    switch (data[TYPE]) {
    case TO_MODULE(MODULE_BOOT): image_store_restart(store); return false;
    case TO_MODULE(MODULE_IDLE):
    case TO_MODULE(OLD_MODULE_IDLE):
    case TO_MODULE(MODULE_SETUP):
    case TO_MODULE(MODULE_RUN): return true;
    case TO_MODULE(MODULE_BOOTPAGE_SIZE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_SIZE):
        if (length >= SIZE_LENGTH) take_size(frames, store, data, length);
        return false;
    case TO_MODULE(MODULE_BOOTPAGE_NUMBER):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_NUMBER):
        if (length < NUMBER_LENGTH) return false;
        frames->page = data[NUMBER];
        frames->fragment = 0;
        return false;
    case TO_MODULE(MODULE_BOOT_QUERY):
        if (length >= QUERY_LENGTH) frames->asked = data[FIRST];
        return false;
    default: break;
    }
    if (length < BOOT_FRAME_BYTES) return false;
    switch (data[TYPE]) {
    case TO_MODULE(MODULE_BOOTPAGE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE): take_fragment(frames, store, data); break;
    case TO_MODULE(MODULE_BOOTPAGE_CRC): check_pages(store, data); break;
    default: break;
    }
    return false;
}

void boot_frames_answer(const boot_frames_t *frames, const image_store_t *store, uint8_t *data) {
    data[TYPE] = TO_HOST(MODULE_BOOT_REPORT);
    data[FIRST] = frames->asked;
    image_store_report(store, frames->asked, data + REPORT);
}
