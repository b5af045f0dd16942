#include "flash_model.h"

#include <string.h>

#define PAGE_MASK (BOOT_PAGE_BYTES - 1)
#define JMP 0x940C
#define MOST_WORK 100000

uint8_t flash[FLASH_BYTES];
uint32_t flash_operations, flash_power_goes_after;
jmp_buf flash_power;
int32_t flash_stuck_at;

static void count_operation(void) {
    if (++flash_operations == flash_power_goes_after) longjmp(flash_power, 1);
}

static void put(uint32_t address, uint8_t value) {
    assert_true(address < FLASH_BYTES);
    const uint8_t stuck = (int32_t)address == flash_stuck_at;
    flash[address] = (uint8_t)((value & ~stuck) | (flash[address] & stuck));
}

void boot_flash_erase(uint8_t page) {
    for (uint32_t i = 0; i < BOOT_PAGE_BYTES; i++) put(page * BOOT_PAGE_BYTES + i, BOOT_BLANK);
    count_operation();
}

void boot_flash_write(uint8_t page, const uint8_t *bytes) {
    for (uint32_t i = 0; i < BOOT_PAGE_BYTES; i++) {
        const uint32_t address = page * BOOT_PAGE_BYTES + i;
        put(address, flash[address] & bytes[i]);
    }
    count_operation();
}

uint8_t boot_flash_read(uint16_t address) {
    assert_true(address < FLASH_BYTES);
    return flash[address];
}

void flash_erase_chip(void) {
    memset(flash, BOOT_BLANK, sizeof flash);
    flash_operations = flash_power_goes_after = 0;
    flash_stuck_at = -1;
}

uint16_t plain_crc(const uint8_t *bytes, uint32_t count) {
    uint16_t crc = 0xFFFF;
    while (count-- > 0) {
        crc ^= *bytes++;
        for (int bit = 0; bit < 8; bit++) crc = (uint16_t)(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}

uint32_t chance(uint32_t *state, uint32_t below) {
    *state = *state * 1664525u + 1013904223u;
    return (uint32_t)((uint64_t)*state * below >> 32);
}

static void put_word(uint8_t *bytes, uint16_t word) {
    bytes[0] = (uint8_t)word;
    bytes[1] = (uint8_t)(word >> 8);
}

void program_make(program_t *program, uint8_t pages, uint32_t seed, bool checked) {
    const uint32_t used = (uint32_t)(pages * BOOT_PAGE_BYTES - BOOT_PAGE_BYTES / 2);
    memset(program, 0xFF, sizeof *program);
    for (uint32_t i = 0; i < used; i++) program->bytes[i] = (uint8_t)chance(&seed, 256);
    put_word(program->bytes, JMP);
    put_word(program->bytes + 2, pages > 1 ? BOOT_PAGE_BYTES / 2 : BOOT_PAGE_BYTES / 2 - 1);
    program->image.pages = pages;
    program->image.checked = checked;
    if (!checked) return;
    program->image.crc = plain_crc(program->bytes, pages * BOOT_PAGE_BYTES);
    for (int i = 0; i < IMAGE_ID_BYTES; i++) program->image.id[i] = (uint8_t)chance(&seed, 256);
}

// Byte by byte as the document has it, not by the core.
void flash_install(const program_t *program, bool with_record) {
    const uint8_t pages = program->image.pages;
    uint8_t *record = flash + BOOT_RECORD_PAGE * BOOT_PAGE_BYTES;
    memset(flash, BOOT_BLANK, sizeof flash);
    memcpy(flash, program->bytes, pages * BOOT_PAGE_BYTES);
    if (!with_record) return;
    put_word(flash, JMP);
    put_word(flash + 2, BOOT_START_ADDRESS / 2);
    put_word(record, 0xC03F);
    record[2] = pages;
    record[3] = program->image.checked;
    put_word(record + 4, plain_crc(program->bytes, pages * BOOT_PAGE_BYTES));
    memcpy(record + 6, program->image.id, 4);
    memcpy(record + 10, program->bytes, 4);
    put_word(record + 14, plain_crc(record, 14));
}

static uint16_t word_at(uint32_t word) {
    if (2 * word + 1 >= FLASH_BYTES) return 0;
    return (uint16_t)(flash[2 * word] | flash[2 * word + 1] << 8);
}

// The whole program is there, up to where flash was blank before it.
static bool is_there(const program_t *program, bool with_vector) {
    const uint32_t from = with_vector ? 0 : BOOT_VECTOR_BYTES;
    const uint8_t *vector = flash + BOOT_RECORD_PAGE * BOOT_PAGE_BYTES + 10;
    if (program == NULL) return false;
    if (!with_vector && memcmp(vector, program->bytes, BOOT_VECTOR_BYTES) != 0) return false;
    return memcmp(flash + from, program->bytes + from, IMAGE_BYTES - from) == 0;
}

static starts_t which(const program_t *older, const program_t *newer, bool with_vector) {
    if (is_there(older, with_vector)) return STARTS_OLD;
    return is_there(newer, with_vector) ? STARTS_NEW : STARTS_HALF;
}

// An erased word is an instruction that does nothing here, so that execution slides on.
starts_t flash_starts(const program_t *older, const program_t *newer, bool by_boot_reset) {
    image_record_t record;
    uint32_t word = 0;
    const uint32_t loader = BOOT_LOADER_ADDRESS / 2;
    if (!by_boot_reset) {
        while (word < loader && word_at(word) == 0xFFFF) word++;
        const bool to_loader = word_at(word) == JMP && word_at(word + 1) == loader + 2;
        const bool over_record =
            word == BOOT_RECORD_PAGE * BOOT_PAGE_BYTES / 2 && word_at(word) == 0xC03F;
        if (word < loader && !to_loader && !over_record)
            return word == 0 ? which(older, newer, true) : STARTS_HALF;
    }
    return image_record_read(&record) ? which(older, newer, false) : STARTS_LOADER;
}

void send_fragment(image_store_t *store, const program_t *program, uint8_t page, uint8_t fragment) {
    uint8_t bytes[BOOT_FRAGMENT_BYTES];
    for (int i = 0; i < BOOT_FRAGMENT_BYTES; i++) {
        const int offset = fragment * BOOT_FRAGMENT_BYTES + i;
        // Bytes beyond the page are garbage of the overhead controller.
        bytes[i] =
            offset < BOOT_PAGE_BYTES ? program->bytes[page * BOOT_PAGE_BYTES + offset] : 0xA5;
    }
    image_store_fragment(store, page, fragment, bytes);
}

void send_page(image_store_t *store, const program_t *program, uint8_t page) {
    for (uint8_t i = 0; i < BOOT_FRAGMENTS; i++) send_fragment(store, program, page, i);
}

void send_lap(image_store_t *store, const program_t *program) {
    for (uint8_t page = 0; page < program->image.pages; page++) send_page(store, program, page);
}

void work(image_store_t *store) {
    uint32_t steps = 0;
    while (image_store_work(store)) assert_true(steps++ < MOST_WORK);
}

void load(image_store_t *store, const program_t *program) {
    image_store_announce(store, &program->image);
    work(store);
    send_lap(store, program);
    work(store);
}
