/// The CAN frames of a module's boot loader (boot_loaders.md 5.2): what they do to the image store,
/// and the module's answers.
///
/// Pure: data bytes in, orders and data bytes out. Which frames are for this module, the
/// controller's filters decide. Frames that are too short for their type, or of other types, do
/// nothing.
#ifndef MODULE_BOOTLOADER_CORE_BOOT_FRAMES_H
#define MODULE_BOOTLOADER_CORE_BOOT_FRAMES_H

#include "../../../firmware/bootloader/core/image_store.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Data bytes of a frame.
#define BOOT_FRAME_BYTES 8
/// In place of the first page that is asked for.
#define BOOT_NOTHING_ASKED 0xFF

/// State from frame to frame, beside the store; may be read.
typedef struct {
    image_t next;      ///< what the next number of pages announces: CRC and id have come before
    uint8_t page;      ///< that fragments belong to, or BOOT_NO_PAGE
    uint8_t fragment;  ///< that is due
    uint8_t asked;     ///< first page of the answer that is due, or BOOT_NOTHING_ASKED
} boot_frames_t;

/// Nothing has come.
void boot_frames_init(boot_frames_t *frames);

/// Takes the `length` data bytes, 0 to 8, of a frame; `data` has BOOT_FRAME_BYTES. True: start the
/// application if it is valid.
///
/// The fragments of a page rise. One that does not belongs to a page whose number was lost, as do
/// those behind it: they are ignored.
bool boot_frames_take(boot_frames_t *frames, image_store_t *store, const uint8_t *data,
                      uint8_t length);

/// Makes the BOOT_FRAME_BYTES of the answer to what is asked, from how things stand now.
void boot_frames_answer(const boot_frames_t *frames, const image_store_t *store, uint8_t *data);

#ifdef __cplusplus
}
#endif

#endif
