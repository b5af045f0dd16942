/// Light of the cells: red, green and blue LEDs of each.
///
/// To be called from setup() and loop() only: a call takes 0.5 ms a cell on the I2C bus. Cells
/// above 3 are ignored. Orders of the host may change the light as well (states in hardware.md
/// 3.3).
#ifndef KILOGRID_MODULE_LED_H
#define KILOGRID_MODULE_LED_H

#include <stdint.h>

#include "module.h"
#include "module_color.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Lights a cell, or all of them, at ADJUSTED brightness.
void set_LED(cell_num_t cell, color_t color);
void set_all_LEDs(color_t color);

/// Lights a cell, or all of them, with pulse widths of `brightness`, 0..255.
void set_LED_with_brightness(cell_num_t cell, color_t color, brightness_t brightness);
void set_all_LEDs_with_brightness(color_t color, brightness_t brightness);

/// Lights all cells with pulse widths of red, green and blue, 0..255 each.
void set_all_LEDs_hex(uint8_t rgb[3]);

#ifdef __cplusplus
}
#endif

#endif
