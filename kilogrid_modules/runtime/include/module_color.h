/// Colours of the cells' LEDs, for programs (moduleLED.h) and for the runtime itself.
///
/// A colour switches LEDs on; how bright they are is a pulse width of 0..255, the same for all
/// three.
#ifndef KILOGRID_MODULE_COLOR_H
#define KILOGRID_MODULE_COLOR_H

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

/// Names for some of the 256 pulse widths.
typedef enum {
    LOW = 0x05,
    ADJUSTED = 0x20,  ///< for the camera
    HIGH = 0xF0,
    MEDIUM = (LOW + HIGH) / 2,
} brightness_t;

#endif
