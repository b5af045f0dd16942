/// Sensors of robots: a table that all drivers read, native, translated and on boards.
///
/// A new sensor that reads the same for all robots of a run is a row here and a key of the
/// experiment, whose value comes by the row's name; one that reads otherwise has a function.
#ifndef KILOTWIN_ROBOTS_SENSORS_H
#define KILOTWIN_ROBOTS_SENSORS_H

#include <array>
#include <cstdint>

#include "base/clock.h"
#include "kilolib/core/sensors.h"

namespace kilotwin {

struct RobotRecord;

/// By channel of the converter, 0..1023.
using Readings = std::array<int16_t, CONVERTER_CHANNELS>;

struct Sensor {
    const char *name;
    uint8_t channel;  ///< of the converter
    int16_t usual;    ///< reading of a board whose pin no test sets
    /// Reading at a moment; null: that of the run (RobotContext::readings), for all robots.
    int16_t (*read)(const RobotRecord &robot, Cycles at);
};

int16_t battery_of(const RobotRecord &robot, Cycles at);
int16_t light_of(const RobotRecord &robot, Cycles at);

inline constexpr Sensor SENSORS[] = {
    {"battery", SENSOR_BATTERY, 720, battery_of},
    {"light", SENSOR_LIGHT, 0, light_of},
    {"temperature", SENSOR_TEMPERATURE, 300, nullptr},
};

/// The sensor on a channel; null: there is none, and the converter reads 0.
constexpr const Sensor *sensor_on(uint8_t channel) {
    for (const Sensor &sensor : SENSORS)
        if (sensor.channel == channel) return &sensor;
    return nullptr;
}

/// The reading of a robot's converter on a channel at a moment, without noise.
int16_t reading_of(const RobotRecord &robot, uint8_t channel, Cycles at);

/// Readings of a board whose pins no test sets.
constexpr Readings usual_readings() {
    Readings readings = {};
    for (const Sensor &sensor : SENSORS) readings[sensor.channel] = sensor.usual;
    return readings;
}

}  // namespace kilotwin

#endif
