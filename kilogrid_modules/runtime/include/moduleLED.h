/// The light of the cells.
#ifndef KILOGRID_MODULE_LED_H
#define KILOGRID_MODULE_LED_H

#include <stdint.h>

#include "module.h"

/// Bit 0 red, bit 1 green, bit 2 blue.
typedef enum {
    LED_OFF = 0,
    RED = 1,
    GREEN = 2,
    YELLOW = 3,
    BLUE = 4,
    MAGENTA = 5,
    CYAN = 6,
    WHITE = 7,
} color_t;

/// Names for some of the 256 values.
typedef enum {
    LOW = 0x05,
    ADJUSTED = 0x20,  ///< for the camera
    HIGH = 0xF0,
    MEDIUM = (LOW + HIGH) / 2,
} brightness_t;

#ifdef __cplusplus
extern "C" {
#endif

/// At ADJUSTED brightness.
void set_LED(cell_num_t cell, color_t color);
void set_all_LEDs(color_t color);

void set_LED_with_brightness(cell_num_t cell, color_t color, brightness_t brightness);
void set_all_LEDs_with_brightness(color_t color, brightness_t brightness);

/// Red, green and blue, 0..255 each.
void set_all_LEDs_hex(uint8_t rgb[3]);

#ifdef __cplusplus
}
#endif

#endif
