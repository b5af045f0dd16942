#include <avr/boot.h>
#include <avr/pgmspace.h>
#include <util/atomic.h>

#include "../core/boot_flash.h"

// An operation has to begin within four cycles of being announced. While it goes on, the pages
// cannot be read, but the loader runs, and so do its interrupts.
static void finish(void) {
    boot_spm_busy_wait();
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { boot_rww_enable(); }
}

void boot_flash_erase(uint8_t page) {
    const uint16_t address = (uint16_t)(page * BOOT_PAGE_BYTES);
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { boot_page_erase(address); }
    finish();
}

void boot_flash_write(uint8_t page, const uint8_t *bytes) {
    const uint16_t address = (uint16_t)(page * BOOT_PAGE_BYTES);
    for (uint8_t i = 0; i < BOOT_PAGE_BYTES; i = (uint8_t)(i + 2)) {
        const uint16_t word = (uint16_t)(bytes[i] | bytes[i + 1] << 8);
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { boot_page_fill(address + i, word); }
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { boot_page_write(address); }
    finish();
}

uint8_t boot_flash_read(uint16_t address) { return pgm_read_byte(address); }
