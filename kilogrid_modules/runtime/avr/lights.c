#include "lights.h"

#include <string.h>

#include "../core/light_patterns.h"
#include "board.h"
#include "i2c.h"
#include "moduleLED.h"

// Datasheet of the PCA9635, chapter 7.
#define FROM_REGISTER(n) (0x80 | (n))  // the register number counts up after each byte
enum { MODE1 = 0x00, PWM0 = 0x02, LEDOUT0 = 0x14 };
enum { AWAKE = 0x80, BY_PWM = 0xAA };

#define PARTS 3

static void show(uint8_t cell, const uint8_t rgb[PARTS]) {
    runtime_i2c_write(LED_DRIVER_ADDRESS, (uint8_t)FROM_REGISTER(PWM0 + PARTS * cell), rgb, PARTS);
}

void runtime_lights_init(void) {
    static const uint8_t modes[] = {AWAKE, LED_DRIVER_MODE2};
    static const uint8_t outputs[] = {BY_PWM, BY_PWM, BY_PWM, BY_PWM};
    runtime_i2c_init();
    runtime_i2c_write(LED_DRIVER_ADDRESS, FROM_REGISTER(MODE1), modes, sizeof modes);
    set_all_LEDs(LED_OFF);
    runtime_i2c_write(LED_DRIVER_ADDRESS, FROM_REGISTER(LEDOUT0), outputs, sizeof outputs);
}

void set_LED_with_brightness(cell_num_t cell, color_t color, brightness_t brightness) {
    if (cell >= N_CELLS) return;
    uint8_t rgb[PARTS];
    for (uint8_t part = 0; part < PARTS; part++)
        rgb[part] = color_part((uint8_t)color, (uint8_t)brightness, part);
    show(cell, rgb);
}

void set_LED(cell_num_t cell, color_t color) { set_LED_with_brightness(cell, color, ADJUSTED); }

void set_all_LEDs_with_brightness(color_t color, brightness_t brightness) {
    for (uint8_t i = 0; i < N_CELLS; i++) set_LED_with_brightness((cell_num_t)i, color, brightness);
}

void set_all_LEDs(color_t color) { set_all_LEDs_with_brightness(color, ADJUSTED); }

void set_all_LEDs_hex(uint8_t rgb[3]) {
    for (uint8_t cell = 0; cell < N_CELLS; cell++) show(cell, rgb);
}
