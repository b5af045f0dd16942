#include "boot_messages.h"

#include <stddef.h>
#include <string.h>

#define WORDS_OF_FRAGMENT (BOOT_FRAGMENT_BYTES / 2)
#define CRCS_OF_MESSAGE 4
// Pages up to which a message may begin: the first of the last four.
#define LAST_CRC_PAGE (BOOT_PAGES - CRCS_OF_MESSAGE)

// Places in the data of messages.
enum { SIZE_PAGES = 0, SIZE_MARK = 1, SIZE_CRC = 3, SIZE_ID = 5 };
enum { PAGE_NUMBER = 0, PAGE_OFFSET = 1, PAGE_BYTES = 2 };
enum { CRC_PAGE = 0, CRC_VALUES = 1 };

static uint16_t word_at(const uint8_t *data) { return (uint16_t)(data[0] | data[1] << 8); }

// A sender that is none of ours announces pages only.
static void announce(image_store_t *store, const uint8_t *data) {
    image_t image;
    memset(&image, 0xFF, sizeof image);
    image.pages = data[SIZE_PAGES];
    image.checked = 0;
    if (data[SIZE_MARK] == 'K' && data[SIZE_MARK + 1] == 'T') {
        image.checked = 1;
        image.crc = word_at(data + SIZE_CRC);
        memcpy(image.id, data + SIZE_ID, IMAGE_ID_BYTES);
    }
    image_store_announce(store, &image);
}

// By subtraction: a division takes more room than the loop does time.
static void take_fragment(image_store_t *store, const uint8_t *data) {
    uint8_t rest = data[PAGE_OFFSET];
    uint8_t fragment = 0;
    for (; rest >= WORDS_OF_FRAGMENT; fragment++) rest = (uint8_t)(rest - WORDS_OF_FRAGMENT);
    if (rest == 0) image_store_fragment(store, data[PAGE_NUMBER], fragment, data + PAGE_BYTES);
}

static void check_pages(image_store_t *store, const uint8_t *data) {
    const uint8_t first = data[CRC_PAGE];
    if (first % CRCS_OF_MESSAGE != 0 || first > LAST_CRC_PAGE) return;
    const uint8_t *crc = data + CRC_VALUES;
    for (uint8_t i = 0; i < CRCS_OF_MESSAGE; i++, crc += 2)
        image_store_check_page(store, (uint8_t)(first + i), word_at(crc));
}

static boot_order_t take_query(const uint8_t *data, uint16_t uid, boot_query_t *query) {
    if (!robot_query_is_for(data, uid)) return BOOT_ORDER_NONE;
    query->first = data[QUERY_FIRST];
    query->slot = robot_query_slot(uid, data[QUERY_NONCE], data[QUERY_SLOTS]);
    return BOOT_ORDER_ANSWER;
}

boot_order_t boot_message_take(image_store_t *store, const message_t *message, uint16_t uid,
                               boot_query_t *query) {
    const uint8_t *data = message->data;
    switch (message->type) {
    case BOOT: image_store_restart(store); return BOOT_ORDER_NONE;
    case BOOTPGM_SIZE: announce(store, data); return BOOT_ORDER_NONE;
    case BOOTPGM_PAGE: take_fragment(store, data); return BOOT_ORDER_NONE;
    case BOOTPGM_CRC: check_pages(store, data); return BOOT_ORDER_NONE;
    case BOOTPGM_QUERY: return take_query(data, uid, query);
    case RESET:
    case SLEEP:
    case WAKEUP:
    case CHARGE:
    case VOLTAGE:
    case RUN:
    case READUID:
    case CALIB:
    case BOOTPGM_START: return BOOT_ORDER_LEAVE;
    default: return BOOT_ORDER_NONE;
    }
}

void boot_message_report(const image_store_t *store, uint8_t first, uint16_t uid,
                         message_t *message) {
    uint8_t *data = message->data;
    data[REPORT_UID] = (uint8_t)uid;
    data[REPORT_UID + 1] = (uint8_t)(uid >> 8);
    data[REPORT_FIRST] = first;
    image_store_report(store, first, data + REPORT_BYTES);
    message->type = BOOTPGM_REPORT;
    message->crc = image_crc(message, offsetof(message_t, crc));
}
