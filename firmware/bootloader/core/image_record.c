#include "image_record.h"

#include <stddef.h>
#include <string.h>

#define OPCODE_JMP 0x940C
#define OPCODE_RJMP 0xC000
#define RJMP_MASK 0xF800  // also the sign of its offset: forwards
#define BLANK_WORD 0xFFFF
#define VECTOR_WORDS (BOOT_VECTOR_BYTES / 2)
#define PAGE_WORDS (BOOT_PAGE_BYTES / 2)
#define RECORD_ADDRESS (BOOT_RECORD_PAGE * BOOT_PAGE_BYTES)
#define SLIDE (OPCODE_RJMP | ((BOOT_LOADER_ADDRESS - RECORD_ADDRESS) / 2 - 1))

// Constants are kept out of tables: these would lie in RAM, which is not set up yet when an
// application is started.
static void put_word(uint8_t *bytes, uint16_t word) {
    bytes[0] = (uint8_t)word;
    bytes[1] = (uint8_t)(word >> 8);
}

static uint16_t word_of(const uint8_t *bytes) { return (uint16_t)(bytes[0] | bytes[1] << 8); }

// A word at an address below the loader.
static __attribute__((noinline)) uint16_t flash_word(uint16_t address) {
    const uint8_t low = boot_flash_read(address);
    return (uint16_t)(low | boot_flash_read((uint16_t)(address + 1)) << 8);
}

__attribute__((noinline)) crc16_t image_crc_add(crc16_t crc, uint8_t byte) {
    crc16_add(&crc, byte);
    return crc;
}

uint16_t image_crc(const void *bytes, uint8_t count) {
    const uint8_t *byte = bytes;
    crc16_t crc = crc16_start();
    while (count-- > 0) crc = image_crc_add(crc, *byte++);
    return crc16_value(crc);
}

void image_put_loaders_vector(uint8_t *bytes) {
    put_word(bytes, OPCODE_JMP);
    put_word(bytes + 2, BOOT_START_ADDRESS / 2);
}

bool image_vector_is_loaders(void) {
    return flash_word(0) == OPCODE_JMP && flash_word(2) == BOOT_START_ADDRESS / 2;
}

void image_record_seal(image_record_t *record) {
    record->slide = SLIDE;
    record->record_crc = image_crc(record, offsetof(image_record_t, record_crc));
}

bool image_record_read(image_record_t *record) {
    uint8_t *bytes = (uint8_t *)record;
    for (uint8_t i = 0; i < (uint8_t)sizeof *record; i++)
        bytes[i] = boot_flash_read((uint16_t)(RECORD_ADDRESS + i));
    return image_crc(record, sizeof *record) == 0 && image_vector_is_loaders() &&
           image_entry(record->vector, record->image.pages) != IMAGE_NO_ENTRY;
}

// The target of an rjmp counts from the word behind it.
uint16_t image_entry(const uint8_t *vector, uint8_t pages) {
    const uint16_t opcode = word_of(vector);
    uint16_t entry = IMAGE_NO_ENTRY;
    if (opcode == OPCODE_JMP) entry = word_of(vector + 2);
    if ((opcode & RJMP_MASK) == OPCODE_RJMP) entry = (uint16_t)((opcode & ~RJMP_MASK) + 1);
    const bool inside = entry >= VECTOR_WORDS && entry < (uint16_t)(pages * PAGE_WORDS);
    return inside ? entry : IMAGE_NO_ENTRY;
}

uint16_t image_application_entry(void) {
    image_record_t record;
    if (image_record_read(&record)) return image_entry(record.vector, record.image.pages);
    const bool foreign = flash_word(0) != BLANK_WORD && !image_vector_is_loaders();
    return foreign ? 0 : IMAGE_NO_ENTRY;
}
