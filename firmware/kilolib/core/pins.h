/// Pins of the Kilobot's board that carry motors and LED (hardware.md 1.8), and what their
/// registers make of them.
///
/// A motor hangs on an output of timer 2, and stands still while its pin is an input. Each part of
/// the LED has two pins of different currents; one that is an output and low is lit.
#ifndef KILOLIB_CORE_PINS_H
#define KILOLIB_CORE_PINS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LEFT_MOTOR_MASK 0x08   ///< PB3, OC2A
#define RIGHT_MOTOR_MASK 0x08  ///< PD3, OC2B
#define LED_MASK_C 0x3C        ///< PC3, PC2 green bit 0, 1; PC5, PC4 blue bit 0, 1
#define LED_MASK_D 0x30        ///< PD5, PD4 red bit 0, 1

/// Direction bits of ports C and D that light a colour, an RGB() value.
typedef struct {
    uint8_t ddrc, ddrd;  ///< within LED_MASK_C and LED_MASK_D
} led_pins_t;

/// The pins of a colour; bits of `rgb` above the six are ignored.
static inline led_pins_t led_pins(uint8_t rgb) {
    led_pins_t on = {0, 0};
    if (rgb & 1 << 0) on.ddrd |= 1 << 5;
    if (rgb & 1 << 1) on.ddrd |= 1 << 4;
    if (rgb & 1 << 2) on.ddrc |= 1 << 3;
    if (rgb & 1 << 3) on.ddrc |= 1 << 2;
    if (rgb & 1 << 4) on.ddrc |= 1 << 5;
    if (rgb & 1 << 5) on.ddrc |= 1 << 4;
    return on;
}

/// The colour that lit pins make: the inverse of led_pins(). Other pins do not matter.
static inline uint8_t led_color(uint8_t lit_c, uint8_t lit_d) {
    return (uint8_t)((lit_d >> 5 & 1) << 0 | (lit_d >> 4 & 1) << 1 | (lit_c >> 3 & 1) << 2 |
                     (lit_c >> 2 & 1) << 3 | (lit_c >> 5 & 1) << 4 | (lit_c >> 4 & 1) << 5);
}

#ifdef __cplusplus
}
#endif

#endif
