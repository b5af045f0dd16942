// malloc() in a heap that is part of the robot's state and runs out, as the robot's 2 KB would.
// First fit. Which units are used is kept apart from the blocks, so that a program that writes
// beyond one, or frees an invalid pointer, damages its own data only. Linked only into programs
// that use it.
#include <stddef.h>
#include <stdint.h>
#include <string.h>

void *malloc(size_t bytes);
void free(void *memory);
void *calloc(size_t count, size_t size);
void *realloc(void *memory, size_t bytes);

/// Four times the robot's 2,048 bytes of RAM less kilolib's own 110 and a stack of 400: pointers,
/// and the size ahead of a block, have 8 bytes here and 2 there. Lists that fit there must fit
/// here.
enum { HEAP_BYTES = 4 * 1536, UNIT = 8, UNITS = HEAP_BYTES / UNIT };

/// State of a unit. FIRST is not given to the program: avr-libc has the block's size there.
enum { FREE, FIRST, MORE };

static uint8_t heap[HEAP_BYTES] __attribute__((aligned(UNIT)));
static uint8_t units[UNITS];

// Tuning variables of avr-libc; they have no effect here.
// NOLINTBEGIN(bugprone-reserved-identifier)
__attribute__((weak)) size_t __malloc_margin = 32;
__attribute__((weak)) char *__malloc_heap_start = (char *)heap;
__attribute__((weak)) char *__malloc_heap_end = (char *)heap + HEAP_BYTES;
// NOLINTEND(bugprone-reserved-identifier)

/// The first unit of the block at `memory`; NULL: there is none.
static uint8_t *block_at(const void *memory) {
    const uintptr_t offset = (uintptr_t)memory - (uintptr_t)heap - UNIT;
    if (offset >= HEAP_BYTES || offset % UNIT != 0) return NULL;
    uint8_t *block = units + offset / UNIT;
    return *block == FIRST ? block : NULL;
}

static size_t units_of(const uint8_t *block) {
    size_t count = 1;
    while (block + count < units + UNITS && block[count] == MORE) count++;
    return count;
}

void *malloc(size_t bytes) {
    if (bytes > HEAP_BYTES) return NULL;  // no bytes are a block too, as in avr-libc
    const size_t wanted = 1 + (bytes + UNIT - 1) / UNIT;
    for (size_t first = 0, found; first + wanted <= UNITS; first += found + 1) {
        for (found = 0; found < wanted && units[first + found] == FREE;) found++;
        if (found < wanted) continue;
        memset(units + first, MORE, wanted);
        units[first] = FIRST;
        return heap + (first + 1) * UNIT;
    }
    return NULL;
}

void free(void *memory) {
    uint8_t *block = block_at(memory);
    if (block != NULL) memset(block, FREE, units_of(block));
}

void *calloc(size_t count, size_t size) {
    if (size != 0 && count > HEAP_BYTES / size) return NULL;
    void *memory = malloc(count * size);
    return memory == NULL ? NULL : memset(memory, 0, count * size);
}

void *realloc(void *memory, size_t bytes) {
    if (memory == NULL) return malloc(bytes);
    const uint8_t *block = block_at(memory);
    if (block == NULL) return NULL;
    const size_t held = (units_of(block) - 1) * UNIT;
    if (bytes <= held) return memory;
    void *larger = malloc(bytes);
    if (larger == NULL) return NULL;
    memcpy(larger, memory, held);
    free(memory);
    return larger;
}
