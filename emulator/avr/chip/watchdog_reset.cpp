#include "avr/chip/watchdog_reset.h"

#include <cstdio>

namespace kilotwin {

// 2,048 periods of 128 kHz, doubled by each step of WDP, whose highest bit stands apart.
std::string WatchdogReset::text() const {
    const unsigned prescaler = (control & 7u) | (control >> 2 & 8u);
    char text[160];
    std::snprintf(text, sizeof text,
                  "its watchdog reset it: not fed for %u ms, at PC 0x%04X (reset %u by it; the "
                  "program sees WDRF in MCUSR)",
                  16u << prescaler, unsigned(pc), unsigned(number));
    return text;
}

}  // namespace kilotwin
