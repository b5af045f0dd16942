#include "params.h"

#include <stddef.h>
#include <string.h>

void params_reset(params_t *params) {
#define PRESET(name, key, preset, least, most) params->name = (preset);
    WIRE_CONFIG_KEYS(PRESET)
#undef PRESET
}

// Where a parameter lies in params_t, and its range.
typedef struct {
    uint8_t offset;
    uint8_t size;
    uint32_t least;
    uint32_t most;
} field_t;

// A switch, not a table: that would lie in RAM.
static field_t field_of(uint8_t key) {
    switch (key) {
#define FIELD(name, number, preset, least, most) \
    case number:                                 \
        return (field_t){offsetof(params_t, name), sizeof(((params_t *)0)->name), least, most};
        WIRE_CONFIG_KEYS(FIELD)
#undef FIELD
    default: return (field_t){0};
    }
}

bool params_set(params_t *params, uint8_t key, uint32_t value) {
    const field_t field = field_of(key);
    if (field.size == 0 || value < field.least || value > field.most) return false;
    // Robots and PCs are little-endian, so the low bytes come first.
    memcpy((uint8_t *)params + field.offset, &value, field.size);
    return true;
}
