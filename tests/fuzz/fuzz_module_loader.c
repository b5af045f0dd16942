/// Fuzz target: a module's boot loader that is sent any frames: a length and so many bytes each.
#include <assert.h>
#include <string.h>

#include "../../kilogrid_modules/bootloader/core/boot_frames.h"

#include "flash_in_memory.h"

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size) {
    static image_store_t store;
    boot_frames_t frames;
    memset(&store, 0, sizeof store);
    memset(flash, BOOT_BLANK, sizeof flash);
    image_store_init(&store);
    boot_frames_init(&frames);
    for (size_t at = 0; at < size;) {
        uint8_t data[BOOT_FRAME_BYTES] = {0};
        const uint8_t length = input[at++] % 9;
        if (size - at < length) break;
        memcpy(data, input + at, length);
        at += length;
        boot_frames_take(&frames, &store, data, length);
        image_store_work(&store);
        assert(store.state <= STORE_WRONG && store.stored <= BOOT_PAGES);
        assert(store.image.pages <= BOOT_PAGES && store.stored <= BOOT_PAGES);
        if (frames.asked != BOOT_NOTHING_ASKED) boot_frames_answer(&frames, &store, data);
    }
    return 0;
}
