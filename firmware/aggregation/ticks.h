/// Comparing ticks, which wrap: right for two that are less than 2^31 ticks (2.2 years) apart.
#ifndef AGGREGATION_TICKS_H
#define AGGREGATION_TICKS_H

#include <stdbool.h>
#include <stdint.h>

/// Whether the time `at` has come.
static inline bool ticks_reached(uint32_t now, uint32_t at) { return (int32_t)(now - at) >= 0; }

static inline uint32_t ticks_earlier(uint32_t a, uint32_t b) {
    return (int32_t)(a - b) < 0 ? a : b;
}

#endif
