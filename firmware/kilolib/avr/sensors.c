#include <util/atomic.h>

#include "../core/sensors.h"
#include "../core/traits.h"
#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "kilolib.h"

#define RECEIVING (-1)

static int16_t measure(uint8_t channel) {
    int16_t value = RECEIVING;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (!kilolib_infrared_receiving()) value = kilolib_converter_read(channel);
    }
    return value;
}

int16_t get_ambientlight(void) { return measure(SENSOR_LIGHT); }

// The original leaves the converter there, so that the next message's high gain is the battery's.
int16_t get_voltage(void) {
    const int16_t value = measure(SENSOR_BATTERY);
    if (KILOLIB_ORIGINAL && value != RECEIVING) kilolib_converter_sample_on_edge(SENSOR_BATTERY);
    return value;
}

int16_t get_temperature(void) { return measure(SENSOR_TEMPERATURE); }
