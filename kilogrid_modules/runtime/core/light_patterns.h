/// Light patterns of a module (hardware.md 3.3): the show at power-up, breathing, and the colour of
/// what is being forwarded.
///
/// Pure: from a step, or a type, to a colour; the driver counts the steps and writes the LEDs. A
/// handful of instructions each.
#ifndef MODULE_CORE_LIGHT_PATTERNS_H
#define MODULE_CORE_LIGHT_PATTERNS_H

#include <stdbool.h>
#include <stdint.h>

#include "../include/module_color.h"
#include "../include/module_limits.h"

#ifdef __cplusplus
extern "C" {
#endif

/// The show of module_init(): red, green, blue, each cell by cell on and off again. All LEDs work
/// if all of it is seen. Step 0..SHOW_STEPS - 1 lasts SHOW_STEP_MS.
#define SHOW_STEP_MS 50
#define SHOW_STEPS_PER_COLOR (2 * N_CELLS)
#define SHOW_STEPS (3 * SHOW_STEPS_PER_COLOR)

/// Breathing in IDLE: white, brightness 0 up to 20 and down again, a step every 70 ms.
#define BREATH_STEP_MS 70
#define BREATH_STEPS 40

/// The one cell that changes at a step of the show: a driver that has to write each LED by itself
/// needs to write this one only.
static inline uint8_t pattern_show_cell(uint8_t step) { return step % N_CELLS; }

/// The colour of a cell during a step 0..SHOW_STEPS - 1 of the show, a color_t.
static inline uint8_t pattern_show_color(uint8_t step, uint8_t cell) {
    const uint8_t of_color = step % SHOW_STEPS_PER_COLOR;
    const bool is_lit = of_color < N_CELLS ? cell <= of_color : cell > of_color - N_CELLS;
    const uint8_t color = (uint8_t)(1 << step / SHOW_STEPS_PER_COLOR);
    return is_lit ? color : 0;
}

/// Brightness of step 0..BREATH_STEPS - 1, for all cells; step 0 follows the last one.
static inline uint8_t pattern_breath(uint8_t step) {
    return step <= BREATH_STEPS / 2 ? step : (uint8_t)(BREATH_STEPS - step);
}

/// Pulse width of one part of a colour: 0 red, 1 green, 2 blue; `brightness` or 0.
static inline uint8_t color_part(uint8_t color, uint8_t brightness, uint8_t part) {
    return (color >> part & 1) != 0 ? brightness : 0;
}

/// The colour while an infrared message of this type is forwarded; dark for what is no command.
color_t pattern_command_color(uint8_t type);

/// The colour of a cell that has sent page `page` of the robots' program: blue and green in turn.
color_t pattern_page_color(uint8_t page);

#ifdef __cplusplus
}
#endif

#endif
