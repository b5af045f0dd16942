/// The image store: takes a program's pages in fragments, writes them to flash, and makes the
/// program valid when it is whole (boot_loaders.md 3, boot_loaders.md 4). Robots get fragments by
/// infrared light; the frames of CAN have the same geometry.
///
/// A page is BOOT_FRAGMENTS fragments. Each counts once, in any order and in any lap, so what is
/// lost is made up for frame by frame. A power cut between any two flash operations leaves the old
/// program, the new one, or the waiting loader.
///
/// Pure but for the flash (boot_flash.h): no registers, no clock, nothing allocated. The caller
/// owns the memory. No call is for an interrupt. The first fragment takes 25 ms on the chip, others
/// two flash operations and the reading of a page, some 10 ms, at most; image_store_work() goes on
/// with what is left, and takes no longer.
#ifndef BOOTLOADER_CORE_IMAGE_STORE_H
#define BOOTLOADER_CORE_IMAGE_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "boot_flash.h"
#include "image_record.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BOOT_FRAGMENTS 22      ///< of a page
#define BOOT_FRAGMENT_BYTES 6  ///< the last one has 2 bytes of the page, and 4 that do not count
#define BOOT_BITS_BYTES 3      ///< with a bit for each fragment of a page
#define BOOT_NO_PAGE 0xFF

/// Where a replacement stands.
typedef enum {
    STORE_EMPTY,      ///< no image is announced
    STORE_ANNOUNCED,  ///< no fragment of it has come, and nothing was erased
    STORE_LOADING,    ///< pages are written as they come
    STORE_CHECKING,   ///< all is there: CRC, what is left over, record
    STORE_COMPLETE,   ///< valid
    STORE_WRONG,      ///< all is there, but the CRC is another one, or it cannot be started
} store_state_t;

/// About 820 bytes. `state` and `image` may be read; `checked` says whether the sender starts a
/// complete image, or the loader by itself.
typedef struct {
    uint8_t state;  ///< a store_state_t
    image_t image;
    uint8_t page;                       ///< in `bytes`, or BOOT_NO_PAGE
    uint8_t stored;                     ///< pages that are complete in flash
    uint8_t cursor;                     ///< page that image_store_work() goes on with
    crc16_t crc;                        ///< of the pages before it, while checking
    uint8_t vector[BOOT_VECTOR_BYTES];  ///< the image's own, which page 0 in flash lacks
    uint8_t bytes[BOOT_PAGE_BYTES];     ///< a page that is being filled, or the next to be written
    uint8_t received[BOOT_PAGES * BOOT_BITS_BYTES];  ///< a bit for each fragment
} image_store_t;

/// Nothing is announced. Does not touch the flash.
void image_store_init(image_store_t *store);

/// The host calls robots or modules into their loaders, again perhaps. The original forgets what it
/// has got. A sender of ours repeats the call for those that missed it, which must not cost the
/// others anything: an image with a CRC stays.
void image_store_restart(image_store_t *store);

/// Takes an announcement. The same image again changes nothing, whatever has come of it. Another
/// one begins anew; the old program stays valid until a fragment comes. One that is in flash
/// already, by its record, is complete as soon as image_store_work() has found its CRC right. One
/// of no pages, or too many, is ignored.
void image_store_announce(image_store_t *store, const image_t *image);

/// Takes fragment 0 to BOOT_FRAGMENTS - 1 of a page. One that is there already, cannot be, or is
/// not announced, is ignored. In an image without a CRC, a fragment that differs from what is there
/// belongs to another image with as many pages: everything begins anew, with that fragment. The
/// old program goes with the first one; where the flash does not take that, it is ignored, too.
void image_store_fragment(image_store_t *store, uint8_t page, uint8_t fragment,
                          const uint8_t *bytes);

/// Takes the CRC-16 of a page, as sent. A page that is complete and differs is forgotten; if it is
/// page 0, so is all that came.
void image_store_check_page(image_store_t *store, uint8_t page, uint16_t crc);

/// Does the next piece of what goes on by itself: checking, erasing what is left over, making
/// valid. To be called whenever nothing waits to be received; false if there is nothing to do.
bool image_store_work(image_store_t *store);

#define BOOT_REPORT_BYTES 6
#define BOOT_REPORT_PAGES 32      ///< that one answer is about
#define BOOT_QUERY_IDENTITY 0xE0  ///< in place of the first of them: the image's id

/// State in an answer.
enum {
    BOOT_REPORT_NOTHING = 0,   ///< no image is announced, and there is no valid one
    BOOT_REPORT_LOADING = 1,   ///< announced, not complete
    BOOT_REPORT_COMPLETE = 2,  ///< valid; also one that was there before any was announced
    BOOT_REPORT_WRONG = 3,     ///< complete, and its CRC is wrong or it cannot be started
};

/// Makes the BOOT_REPORT_BYTES of an answer that infrared light and CAN have in common: four bytes
/// with a bit for each of the pages from `first` on, set if it is missing in whole or in part, or
/// with the id of the image; a BOOT_REPORT_ state; the id's lowest byte. The image is the one that
/// is announced, and if none is, the one that is valid. Pages that it does not have are not
/// missing; an id that is not known is 0xFF.
void image_store_report(const image_store_t *store, uint8_t first, uint8_t *report);

#ifdef __cplusplus
}
#endif

#endif
