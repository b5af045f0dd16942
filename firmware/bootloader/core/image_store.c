#include "image_store.h"

#include <string.h>

#define LAST_FRAGMENT (BOOT_FRAGMENTS - 1)
#define LAST_FRAGMENT_BYTES (BOOT_PAGE_BYTES - LAST_FRAGMENT * BOOT_FRAGMENT_BYTES)
// Functions that a loader has no room for copies of.
#define NOT_COPIED __attribute__((noinline))
// Operations that prepare() takes, five at most, and as many again that the flash did not take.
#define PREPARE_TRIES 10
// Bits without a fragment in the third byte of a page.
#define UNUSED_BITS ((uint8_t)(0xFF << (BOOT_FRAGMENTS - 16)))

static uint8_t flash_byte(uint8_t page, uint8_t offset) {
    return boot_flash_read((uint16_t)(page * BOOT_PAGE_BYTES + offset));
}

// The page in flash has these bytes; NULL: it is blank.
static bool page_has(uint8_t page, const uint8_t *bytes) {
    for (uint8_t i = 0; i < BOOT_PAGE_BYTES; i++)
        if (flash_byte(page, i) != (bytes != NULL ? bytes[i] : BOOT_BLANK)) return false;
    return true;
}

// Erases the page if it is not blank. True if it was.
static bool make_blank(uint8_t page) {
    if (page_has(page, NULL)) return true;
    boot_flash_erase(page);
    return false;
}

// Does the next operation that makes a page these bytes. True if it has them, so each operation is
// verified by the next call.
static bool make_page(uint8_t page, const uint8_t *bytes) {
    if (page_has(page, bytes)) return true;
    if (make_blank(page)) boot_flash_write(page, bytes);
    return false;
}

// Fragments: where one begins in its page, and its bit among those of eight.
static uint8_t offset_of(uint8_t fragment) { return (uint8_t)(fragment * BOOT_FRAGMENT_BYTES); }

static uint8_t mask_of(uint8_t number) { return (uint8_t)(1 << (number & 7)); }

// Where the bits of a page begin.
static NOT_COPIED uint16_t bits_of(uint8_t page) { return (uint16_t)(page * BOOT_BITS_BYTES); }

static bool is_complete(const image_store_t *store, uint8_t page) {
    const uint8_t *bits = store->received + bits_of(page);
    return (bits[0] & bits[1] & (bits[2] | UNUSED_BITS)) == 0xFF;
}

// A byte of the image as it was sent.
static uint8_t sent_byte(const image_store_t *store, uint8_t page, uint8_t offset) {
    if (page == store->page) return store->bytes[offset];
    if (page == 0 && offset < BOOT_VECTOR_BYTES) return store->vector[offset];
    return flash_byte(page, offset);
}

static crc16_t add_page(const image_store_t *store, uint8_t page, crc16_t crc) {
    for (uint8_t i = 0; i < BOOT_PAGE_BYTES; i++)
        crc = image_crc_add(crc, sent_byte(store, page, i));
    return crc;
}

// All that came is forgotten. What is in flash stays until it is erased.
static void forget(image_store_t *store, store_state_t state) {
    store->state = (uint8_t)state;
    store->page = BOOT_NO_PAGE;
    store->stored = 0;
    store->cursor = 0;
    memset(store->vector, BOOT_BLANK, BOOT_VECTOR_BYTES);
    memset(store->received, 0, sizeof store->received);
}

static void check_image(image_store_t *store) {
    store->state = STORE_CHECKING;
    store->cursor = 0;
    store->crc = crc16_start();
}

void image_store_init(image_store_t *store) { forget(store, STORE_EMPTY); }

void image_store_restart(image_store_t *store) {
    if (!store->image.checked) image_store_init(store);
}

// The record is not believed before the flash was read.
void image_store_announce(image_store_t *store, const image_t *image) {
    image_record_t record;
    if (image->pages == 0 || image->pages > BOOT_PAGES) return;
    if (store->state != STORE_EMPTY && memcmp(&store->image, image, sizeof *image) == 0) return;
    forget(store, STORE_ANNOUNCED);
    store->image = *image;
    const bool installed = image_record_read(&record);
    if (!installed || memcmp(&record.image, image, sizeof *image) != 0) return;
    memcpy(store->vector, record.vector, BOOT_VECTOR_BYTES);
    memset(store->received, 0xFF, sizeof store->received);
    check_image(store);
}

// The next operation of those that make page 0 lead to the loader and nothing else. The record
// goes first, without which nothing is started. Page 0 is never blank but with page 1 behind it
// that leads to the loader, too; where page 0 does not lead there yet, so does none.
static bool prepare_next(image_store_t *store) {
    const uint8_t *bytes = store->bytes;
    if (!make_blank(BOOT_RECORD_PAGE)) return false;
    if (image_vector_is_loaders() && !page_has(0, bytes) && !make_page(1, bytes)) return false;
    return make_page(0, bytes);
}

// False if the flash does not take it.
static bool prepare(image_store_t *store) {
    memset(store->bytes, BOOT_BLANK, BOOT_PAGE_BYTES);
    image_put_loaders_vector(store->bytes);
    for (uint8_t i = 0; i < PREPARE_TRIES; i++) {
        if (!prepare_next(store)) continue;
        store->state = STORE_LOADING;
        return true;
    }
    return false;
}

// A page that has to come again is erased then. Page 0 is not erased alone: everything is prepared
// anew.
static NOT_COPIED void drop_page(image_store_t *store, uint8_t page) {
    if (page == 0) forget(store, STORE_ANNOUNCED);
    memset(store->received + bits_of(page), 0, BOOT_BITS_BYTES);
}

// Bytes that are not known yet are blank, and written when the page has its next turn. A page that
// does not read as it was written has to come again.
static void write_page(image_store_t *store) {
    const uint8_t page = store->page;
    store->page = BOOT_NO_PAGE;
    if (page == 0) {
        memcpy(store->vector, store->bytes, BOOT_VECTOR_BYTES);
        image_put_loaders_vector(store->bytes);
    }
    boot_flash_write(page, store->bytes);
    if (!page_has(page, store->bytes)) {
        drop_page(store, page);
        return;
    }
    if (!is_complete(store, page)) return;
    if (++store->stored == store->image.pages) check_image(store);
}

// A page that nothing has come of holds the old program. Known bytes of one that was written in
// part are read back.
static void open_page(image_store_t *store, uint8_t page) {
    const uint8_t *bits = store->received + bits_of(page);
    if (page != 0 && (bits[0] | bits[1] | bits[2]) == 0) (void)make_blank(page);
    for (uint8_t i = 0; i < BOOT_PAGE_BYTES; i++) store->bytes[i] = sent_byte(store, page, i);
    store->page = page;
}

// Makes `page` the one in RAM. False if what was there before it spoils everything.
static bool turn_to(image_store_t *store, uint8_t page) {
    if (store->page == page) return true;
    if (store->page != BOOT_NO_PAGE) write_page(store);
    if (store->state != STORE_LOADING) return false;
    open_page(store, page);
    return true;
}

// Bytes beyond the page, in the last fragment, do not count.
static bool differs(const image_store_t *store, uint8_t page, uint8_t offset, const uint8_t *bytes,
                    uint8_t count) {
    while (count-- > 0)
        if (*bytes++ != sent_byte(store, page, offset++)) return true;
    return false;
}

void image_store_fragment(image_store_t *store, uint8_t page, uint8_t fragment,
                          const uint8_t *bytes) {
    if (store->state == STORE_EMPTY || store->state == STORE_COMPLETE) return;
    if (page >= store->image.pages || fragment > LAST_FRAGMENT) return;
    const uint8_t offset = offset_of(fragment), mask = mask_of(fragment);
    const uint8_t count = fragment < LAST_FRAGMENT ? BOOT_FRAGMENT_BYTES : LAST_FRAGMENT_BYTES;
    uint8_t *bits = store->received + bits_of(page) + (fragment >> 3);
    if ((*bits & mask) != 0) {
        if (store->image.checked || !differs(store, page, offset, bytes, count)) return;
        forget(store, STORE_ANNOUNCED);
    }
    if (store->state == STORE_ANNOUNCED && !prepare(store)) return;
    if (!turn_to(store, page)) return;
    memcpy(store->bytes + offset, bytes, count);
    *bits |= mask;
    if (is_complete(store, page)) write_page(store);
}

void image_store_check_page(image_store_t *store, uint8_t page, uint16_t crc) {
    if (store->state != STORE_LOADING && store->state != STORE_WRONG) return;
    if (page >= store->image.pages || !is_complete(store, page)) return;
    if (crc16_value(add_page(store, page, crc16_start())) == crc) return;
    store->stored--;
    store->state = STORE_LOADING;
    drop_page(store, page);
}

// The image is right: the record is left. The next call finds it written, or writes it again.
static void make_valid(image_store_t *store) {
    image_record_t record;
    record.image = store->image;
    record.image.crc = crc16_value(store->crc);
    memcpy(record.vector, store->vector, BOOT_VECTOR_BYTES);
    image_record_seal(&record);
    memset(store->bytes, BOOT_BLANK, BOOT_PAGE_BYTES);
    memcpy(store->bytes, &record, sizeof record);
    if (make_page(BOOT_RECORD_PAGE, store->bytes)) store->state = STORE_COMPLETE;
}

// A program that was found in flash and is damaged is loaded like any other.
static void refuse(image_store_t *store) {
    image_record_t record;
    store->state = STORE_WRONG;
    if (image_record_read(&record)) forget(store, STORE_ANNOUNCED);
}

// The CRC is summed up; then what is left of a longer program is erased, through which code slides
// into the loader. A page at a time, so that messages do not wait.
static void check_next(image_store_t *store) {
    const uint8_t page = store->cursor;
    if (page < store->image.pages) {
        store->crc = add_page(store, page, store->crc);
        store->cursor++;
        return;
    }
    const bool right = !store->image.checked || crc16_value(store->crc) == store->image.crc;
    if (!right || image_entry(store->vector, store->image.pages) == IMAGE_NO_ENTRY) {
        refuse(store);
    } else if (page == BOOT_RECORD_PAGE) {
        make_valid(store);
    } else if (make_blank(page)) {
        store->cursor++;
    }
}

bool image_store_work(image_store_t *store) {
    if (store->state != STORE_CHECKING) return false;
    check_next(store);
    return true;
}

static uint8_t report_state(const image_store_t *store, bool installed) {
    switch (store->state) {
    case STORE_EMPTY: return installed ? BOOT_REPORT_COMPLETE : BOOT_REPORT_NOTHING;
    case STORE_COMPLETE: return BOOT_REPORT_COMPLETE;
    case STORE_WRONG: return BOOT_REPORT_WRONG;
    default: return BOOT_REPORT_LOADING;
    }
}

// Bits from the lowest of each byte on.
static void report_missing(const image_store_t *store, uint8_t first, uint8_t *report) {
    memset(report, 0, BOOT_REPORT_PAGES / 8);
    uint8_t mask = 1;
    for (uint8_t i = 0; i < BOOT_REPORT_PAGES && first < store->image.pages; i++, first++) {
        if (!is_complete(store, first)) *report |= mask;
        mask = (uint8_t)(mask << 1);
        if (mask != 0) continue;
        mask = 1;
        report++;
    }
}

void image_store_report(const image_store_t *store, uint8_t first, uint8_t *report) {
    image_record_t record;
    const bool installed = image_record_read(&record);
    const bool empty = store->state == STORE_EMPTY;
    const uint8_t *id = empty ? record.image.id : store->image.id;
    memcpy(report, id, IMAGE_ID_BYTES);
    if (first != BOOT_QUERY_IDENTITY) report_missing(store, first, report);
    report[4] = report_state(store, installed);
    report[5] = id[0];
}
