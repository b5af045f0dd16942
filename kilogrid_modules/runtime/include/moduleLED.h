/// The light of the cells.
#ifndef KILOGRID_MODULE_LED_H
#define KILOGRID_MODULE_LED_H

#include <stdint.h>

#include "module.h"
#include "module_color.h"

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
