/// The chip's flash as a boot loader sees it, and its geometry (boot_loaders.md 1). Robots and
/// modules have the same chip, an ATmega328P whose loader begins at byte 0x7000.
///
/// The three functions are the driver's: of each loader, and of tests. Called by the core only,
/// never from an interrupt.
#ifndef BOOTLOADER_CORE_BOOT_FLASH_H
#define BOOTLOADER_CORE_BOOT_FLASH_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BOOT_PAGE_BYTES 128
#define BOOT_PAGES 220              ///< the most that an application has: bytes 0x0000 to 0x6DFF
#define BOOT_RECORD_PAGE 223        ///< byte 0x6F80: the image record (image_record.h)
#define BOOT_LOADER_ADDRESS 0x7000  ///< entry that stays, a byte address
#define BOOT_START_ADDRESS 0x7004   ///< entry that starts a valid application
#define BOOT_BLANK 0xFF             ///< an erased byte

/// Makes all bytes of a page, 0 to BOOT_RECORD_PAGE, BOOT_BLANK. About 4 ms on the chip.
void boot_flash_erase(uint8_t page);

/// Writes BOOT_PAGE_BYTES into a page without erasing it: bits go from 1 to 0 only, so a byte that
/// is written as BOOT_BLANK keeps its value. About 4 ms on the chip.
void boot_flash_write(uint8_t page, const uint8_t *bytes);

/// The byte at a byte address below BOOT_LOADER_ADDRESS.
uint8_t boot_flash_read(uint16_t address);

#ifdef __cplusplus
}
#endif

#endif
