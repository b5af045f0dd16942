/// Sensors of a Kilobot, by the channels of the converter that reads them (hardware.md 1.8). The
/// receiver's two gains are no sensors: they are read with a frame.
#ifndef KILOLIB_CORE_SENSORS_H
#define KILOLIB_CORE_SENSORS_H

enum { SENSOR_BATTERY = 6, SENSOR_LIGHT = 7, SENSOR_TEMPERATURE = 8 };

/// Channels that the converter has.
#define CONVERTER_CHANNELS 16

#endif
