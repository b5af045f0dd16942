// malloc in a heap that is part of the robot's state and runs out, as the robot's 2 KB would. Only
// programs that use it carry it. First fit over one list of blocks in order of address; neighbours
// that are free are joined.
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "side.h"

void *malloc(size_t bytes);
void free(void *memory);
void *calloc(size_t count, size_t size);
void *realloc(void *memory, size_t bytes);

/// 2,048 bytes of RAM less kilolib's own 110 and a stack of 400, four times: a pointer has 8 bytes
/// here and 2 there, and so have the headers of blocks. Lists that fit there must fit here.
enum { HEAP_BYTES = 4 * 1536, ALIGNMENT = 8 };

typedef struct {
    uint16_t bytes;  ///< of the block, header included; 0 before the first call
    uint16_t used;
    uint32_t unused;
} header_t;

static uint8_t heap[HEAP_BYTES] __attribute__((aligned(ALIGNMENT)));

static header_t *header_at(size_t offset) { return (header_t *)(void *)(heap + offset); }

static void join_free_blocks(void) {
    for (size_t at = 0; at < HEAP_BYTES;) {
        header_t *block = header_at(at);
        size_t next = at + block->bytes;
        if (!block->used && next < HEAP_BYTES && !header_at(next)->used)
            block->bytes = (uint16_t)(block->bytes + header_at(next)->bytes);
        else
            at = next;
    }
}

void *malloc(size_t bytes) {
    if (bytes > HEAP_BYTES) return NULL;  // no bytes are a block too, as in avr-libc
    if (header_at(0)->bytes == 0) header_at(0)->bytes = HEAP_BYTES;
    size_t wanted = (sizeof(header_t) + bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    for (size_t at = 0; at < HEAP_BYTES; at += header_at(at)->bytes) {
        header_t *block = header_at(at);
        if (block->used || block->bytes < wanted) continue;
        if (block->bytes - wanted >= 2 * sizeof(header_t)) {
            *header_at(at + wanted) = (header_t){(uint16_t)(block->bytes - wanted), 0, 0};
            block->bytes = (uint16_t)wanted;
        }
        block->used = 1;
        return block + 1;
    }
    return NULL;
}

void free(void *memory) {
    if (memory == NULL) return;
    ((header_t *)memory - 1)->used = 0;
    join_free_blocks();
}

void *calloc(size_t count, size_t size) {
    if (size != 0 && count > HEAP_BYTES / size) return NULL;
    void *memory = malloc(count * size);
    return memory == NULL ? NULL : memset(memory, 0, count * size);
}

void *realloc(void *memory, size_t bytes) {
    if (memory == NULL) return malloc(bytes);
    size_t held = ((header_t *)memory - 1)->bytes - sizeof(header_t);
    if (bytes <= held) return memory;
    void *larger = malloc(bytes);
    if (larger == NULL) return NULL;
    memcpy(larger, memory, held);
    free(memory);
    return larger;
}
