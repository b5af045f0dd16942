/// Flash of a boot loader under a fuzzer: in memory, and asserted to be below the loader. For one
/// file of a target.
#ifndef FLASH_IN_MEMORY_H
#define FLASH_IN_MEMORY_H

#include <assert.h>
#include <string.h>

#include "bootloader/core/boot_flash.h"

static uint8_t flash[BOOT_LOADER_ADDRESS];

void boot_flash_erase(uint8_t page) {
    assert(page < BOOT_LOADER_ADDRESS / BOOT_PAGE_BYTES);
    memset(flash + page * BOOT_PAGE_BYTES, BOOT_BLANK, BOOT_PAGE_BYTES);
}

void boot_flash_write(uint8_t page, const uint8_t *bytes) {
    assert(page < BOOT_LOADER_ADDRESS / BOOT_PAGE_BYTES);
    for (int i = 0; i < BOOT_PAGE_BYTES; i++) flash[page * BOOT_PAGE_BYTES + i] &= bytes[i];
}

uint8_t boot_flash_read(uint16_t address) {
    assert(address < BOOT_LOADER_ADDRESS);
    return flash[address];
}

#endif
