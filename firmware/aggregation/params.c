#include "params.h"

void params_reset(params_t *params) {
#define PRESET(name, key, preset, least, most) params->name = (preset);
    WIRE_CONFIG_KEYS(PRESET)
#undef PRESET
}

static bool within(uint32_t value, uint32_t least, uint32_t most) {
    return value >= least && value <= most;
}

bool params_set(params_t *params, uint8_t key, uint32_t value) {
    switch (key) {
#define SET(name, number, preset, least, most)          \
    case number:                                        \
        if (!within(value, least, most)) return false;  \
        params->name = (__typeof__(params->name))value; \
        return true;
        WIRE_CONFIG_KEYS(SET)
#undef SET
    default: return false;
    }
}
