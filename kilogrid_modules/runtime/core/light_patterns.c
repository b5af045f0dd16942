#include "light_patterns.h"

#include "../../../firmware/kilogrid/include/message.h"

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

color_t pattern_page_color(uint8_t page) { return page % 2 == 0 ? BLUE : GREEN; }
