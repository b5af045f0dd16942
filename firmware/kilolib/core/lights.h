/// Colours of a robot's LED while its program does not decide (hardware.md 1.3): blinking in IDLE
/// and CHARGING, the battery's colour, the looks round of a sleeping robot.
///
/// The chip blinks by waiting in its main loop; a driver that has no main loop computes the light
/// of a moment. Colours are RGB() values; times cycles of 125 ns. All pure, constant time.
#ifndef KILOLIB_CORE_LIGHTS_H
#define KILOLIB_CORE_LIGHTS_H

#include <stdbool.h>
#include <stdint.h>

#include "kilolib.h"
#include "timer.h"

#define IDLE_COLOR RGB(0, 3, 0)      ///< green, full
#define CHARGING_COLOR RGB(1, 0, 0)  ///< dim red, while the charger is at work
#define BLINK_ON_MS 1                ///< of both
#define BLINK_OFF_MS 200

/// From blink to blink: measured, 0.2 ms more than the two waits.
#define BLINK_PERIOD_CYCLES 1609600UL

/// Whether a blinking LED is on, so long after the state was entered.
static inline bool blink_is_on(uint64_t cycles_in_state) {
    return cycles_in_state % BLINK_PERIOD_CYCLES < (uint64_t)BLINK_ON_MS * CYCLES_PER_MS;
}

/// Colour for a reading of the battery's voltage, 0..1023: green, blue, yellow, red from full to
/// empty.
static inline uint8_t battery_color(int16_t voltage) {
    if (voltage > 682) return RGB(0, 3, 0);
    if (voltage > 648) return RGB(0, 0, 3);
    if (voltage > 614) return RGB(3, 3, 0);
    return RGB(3, 0, 0);
}

#endif
