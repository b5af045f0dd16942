/// A model of the chip's flash for tests of the boot loaders' core: NOR flash, in which a write
/// clears bits and an erase sets those of a page; what power-up starts; and power cuts.
#ifndef TESTS_BOOTLOADER_FLASH_MODEL_H
#define TESTS_BOOTLOADER_FLASH_MODEL_H

#include "../firmware/support.h"
#include "bootloader/core/image_store.h"

#define FLASH_BYTES BOOT_LOADER_ADDRESS
#define IMAGE_BYTES (BOOT_PAGES * BOOT_PAGE_BYTES)

/// The flash below the loader. Tests may write it.
extern uint8_t flash[FLASH_BYTES];

/// Erases and writes since flash_erase_chip().
extern uint32_t flash_operations;

/// Operations after which the power goes, by a jump to flash_power; 0: never.
extern uint32_t flash_power_goes_after;
extern jmp_buf flash_power;

/// Address of a byte whose lowest bit stays as it is, whatever is written or erased; -1: none.
extern int32_t flash_stuck_at;

/// All blank, nothing counted, nothing broken.
void flash_erase_chip(void);

/// A program: bytes to be sent.
typedef struct {
    uint8_t bytes[IMAGE_BYTES];
    image_t image;
} program_t;

/// Makes a program of `pages` pages, and its CRC and id, out of a seed. Its first instruction is a
/// jmp to its second page's begin, or to its last word if it has one page.
void program_make(program_t *program, uint8_t pages, uint32_t seed, bool checked);

/// The CRC-16 of some bytes, bit by bit: the core has another way.
uint16_t plain_crc(const uint8_t *bytes, uint32_t count);

/// Programs a chip as `kilotwin flash` does by ISP: vector, program and record; or, without a
/// record, as avrdude alone does.
void flash_install(const program_t *program, bool with_record);

/// The program that power-up starts.
typedef enum { STARTS_LOADER, STARTS_OLD, STARTS_NEW, STARTS_HALF } starts_t;

/// Follows power-up by the flash's words, with BOOTRST unprogrammed or programmed, to the loader or
/// into a program, and compares that with both byte by byte. `older` or `newer` may be NULL.
starts_t flash_starts(const program_t *older, const program_t *newer, bool by_boot_reset);

/// A small generator of its own, so that failures can be repeated: 0 to below - 1.
uint32_t chance(uint32_t *state, uint32_t below);

/// Hands a fragment of the program to the store.
void send_fragment(image_store_t *store, const program_t *program, uint8_t page, uint8_t fragment);
void send_page(image_store_t *store, const program_t *program, uint8_t page);
/// All pages in order.
void send_lap(image_store_t *store, const program_t *program);

/// Lets the store work until it has nothing to do; fails the test if that takes for ever.
void work(image_store_t *store);

/// Announces and sends one lap.
void load(image_store_t *store, const program_t *program);

#endif
