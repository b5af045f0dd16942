/// rand_hard()'s noise on a robot: the lowest bit of the battery voltage.
#include "../core/random.h"

#include <stdbool.h>
#include <util/atomic.h>

#include "../core/sensors.h"
#include "../core/traits.h"
#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "kilolib.h"

void rand_seed(uint8_t seed) { kilolib_random_seed(seed); }

void kilolib_random_hold(void) { cli(); }
void kilolib_random_release(void) { sei(); }

static bool interrupts_on(void) { return (SREG & BIT(SREG_I)) != 0; }

// A frame just beginning needs the converter for itself, 0.4 ms at most.
uint8_t kilolib_random_noise_bit(void) {
    if (KILOLIB_ORIGINAL) return kilolib_converter_read(SENSOR_BATTERY) & 1;
    while (kilolib_infrared_measuring() && interrupts_on()) {
    }
    uint8_t bit = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { bit = kilolib_converter_read(SENSOR_BATTERY) & 1; }
    return bit;
}
