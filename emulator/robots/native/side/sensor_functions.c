// kilolib's functions that read a sensor, apart from what is linked into every program (sensor.c).
#include "../../../../firmware/kilolib/core/sensors.h"
#include "kilolib.h"
#include "side.h"

int16_t get_ambientlight(void) { return kt_sensor(SENSOR_LIGHT); }
int16_t get_voltage(void) { return kt_sensor(SENSOR_BATTERY); }
int16_t get_temperature(void) { return kt_sensor(SENSOR_TEMPERATURE); }
