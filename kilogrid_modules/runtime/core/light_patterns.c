#include "light_patterns.h"

#include "../../../firmware/kilogrid/include/message.h"

// The colours of the published firmware, by which people at the table know what is going on.
color_t pattern_command_color(uint8_t type) {
    switch (type) {
    case RESET: return GREEN;
    case BOOT: return BLUE;
    case BOOTPGM_PAGE:
    case BOOTPGM_SIZE: return CYAN;
    case SLEEP: return WHITE;
    case RUN: return MAGENTA;
    case CHARGE: return RED;
    case VOLTAGE:
    case CALIB:
    case GO_STRAIGHT:
    case TURN_LEFT:
    case TURN_RIGHT: return YELLOW;
    default: return LED_OFF;
    }
}

// Alternating, so that progress is seen.
color_t pattern_page_color(uint8_t page) { return page % 2 == 0 ? BLUE : GREEN; }
