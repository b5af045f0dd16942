/// Many modules that are in their boot loaders, for tests of the host: the loader's own code, each
/// over a flash and with losses of its own. Called by c_loaders.py.
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "kilogrid_modules/bootloader/core/boot_frames.h"

typedef struct {
    boot_frames_t frames;
    image_store_t store;
    uint8_t flash[BOOT_LOADER_ADDRESS];
    uint32_t luck;
} loader_t;

static loader_t *current;

void boot_flash_erase(uint8_t page) {
    memset(current->flash + page * BOOT_PAGE_BYTES, BOOT_BLANK, BOOT_PAGE_BYTES);
}

// NOR flash: a write clears bits only.
void boot_flash_write(uint8_t page, const uint8_t *bytes) {
    for (size_t i = 0; i < BOOT_PAGE_BYTES; i++)
        current->flash[page * BOOT_PAGE_BYTES + i] &= bytes[i];
}

uint8_t boot_flash_read(uint16_t address) { return current->flash[address]; }

// True with a probability of `share` of 65,536 (Marsaglia's xorshift).
static bool is_lost(loader_t *loader, uint32_t share) {
    loader->luck ^= loader->luck << 13;
    loader->luck ^= loader->luck >> 17;
    loader->luck ^= loader->luck << 5;
    return (loader->luck & 0xFFFF) < share;
}

size_t loader_bytes(void) { return sizeof(loader_t); }

/// Loaders over a program that plain avrdude put there.
void loaders_begin(loader_t *loaders, uint32_t count, uint32_t seed) {
    for (uint32_t i = 0; i < count; i++) {
        memset(&loaders[i], 0x5A, sizeof *loaders);
        loaders[i].luck = (seed + i + 1) * 2654435761U;
        current = &loaders[i];
        boot_frames_init(&current->frames);
        image_store_init(&current->store);
    }
}

/// Hands a frame to loaders `first` to `last`, each of which misses it with that probability, and
/// lets them do what follows.
void loaders_take(loader_t *loaders, uint32_t first, uint32_t last, const uint8_t *data,
                  uint8_t length, uint32_t lost) {
    for (uint32_t i = first; i <= last; i++) {
        current = &loaders[i];
        if (is_lost(current, lost)) continue;
        (void)boot_frames_take(&current->frames, &current->store, data, length);
        while (image_store_work(&current->store)) continue;
    }
}

/// Makes the answer that a loader owes, if it owes one and it is not lost on its way.
bool loader_answers(loader_t *loader, uint8_t *data, uint32_t lost) {
    current = loader;
    if (loader->frames.asked == BOOT_NOTHING_ASKED) return false;
    boot_frames_answer(&loader->frames, &loader->store, data);
    loader->frames.asked = BOOT_NOTHING_ASKED;
    return !is_lost(loader, lost);
}

const uint8_t *loader_flash(const loader_t *loader) { return loader->flash; }
