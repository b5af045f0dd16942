/// The image record, which makes an application valid, and the reset vector (boot_loaders.md 2).
///
/// Page 0 of every application that a loader of ours has stored begins with a jump to the loader;
/// the record keeps the application's own two words. So power-up always comes by the loader.
///
/// Reads the flash by boot_flash.h and keeps nothing, so that these functions can be called before
/// memory is set up. Words are little-endian, as on the chip.
#ifndef BOOTLOADER_CORE_IMAGE_RECORD_H
#define BOOTLOADER_CORE_IMAGE_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "../../kilolib/core/crc16.h"
#include "boot_flash.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BOOT_VECTOR_BYTES 4    ///< of the reset vector: a jmp's two words
#define IMAGE_ID_BYTES 4       ///< lowest byte first
#define IMAGE_NO_ENTRY 0xFFFF  ///< in place of a word address

/// An image as its sender announces it. 8 bytes without gaps, compared as a whole.
typedef struct {
    uint8_t pages;               ///< 1..BOOT_PAGES; the last one is filled up with BOOT_BLANK
    uint8_t checked;             ///< 1: crc and id were sent; 0: not, and all their bits are set
    uint16_t crc;                ///< CRC-16 of all bytes of the pages, as they are sent
    uint8_t id[IMAGE_ID_BYTES];  ///< CRC-32 (zlib) of the same bytes; 0xFF each if it is not known
} image_t;

/// The record as it lies in flash, 16 bytes without gaps; the rest of its page is BOOT_BLANK.
typedef struct {
    uint16_t
        slide;      ///< a jump to the loader: code that slides here through erased flash goes there
    image_t image;  ///< crc is there even if it was not sent
    uint8_t vector[BOOT_VECTOR_BYTES];  ///< the application's own first bytes
    uint16_t record_crc;                ///< CRC-16 of what is before it
} image_record_t;

/// `crc` and one byte more: crc16_add(), of which a loader has no room for copies.
crc16_t image_crc_add(crc16_t crc, uint8_t byte);

/// The CRC-16 of some bytes, 0 of bytes that end with their own.
uint16_t image_crc(const void *bytes, uint8_t count);

/// Reads the record. False if it is not valid: erased, damaged, or of an application whose page 0
/// does not lead to the loader. `record` is what is in flash in any case.
bool image_record_read(image_record_t *record);

/// Completes a record whose image and vector are set.
void image_record_seal(image_record_t *record);

/// Puts the jump to BOOT_START_ADDRESS into the first BOOT_VECTOR_BYTES of page 0.
void image_put_loaders_vector(uint8_t *bytes);

/// Whether page 0 in flash begins with that jump.
bool image_vector_is_loaders(void);

/// Where the first instruction of an image of `pages` pages leads, a word address: of a jmp or an
/// rjmp into the image. IMAGE_NO_ENTRY if it is anything else, which a loader cannot start.
uint16_t image_entry(const uint8_t *vector, uint8_t pages);

/// Word address at which the application in flash starts; IMAGE_NO_ENTRY if there is none, or none
/// that is whole. 0 for one that was not stored by a loader of ours: page 0 has a reset vector of
/// its own, which no replacement leaves there (boot_loaders.md 4).
uint16_t image_application_entry(void);

#ifdef __cplusplus
}
#endif

#endif
