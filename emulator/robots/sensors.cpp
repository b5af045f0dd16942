#include "robots/sensors.h"

#include "robots/record.h"

namespace kilotwin {

int16_t battery_of(const RobotRecord &robot, Cycles at) { return robot.voltage(at); }
int16_t light_of(const RobotRecord &robot, Cycles /*at*/) { return robot.light; }

int16_t reading_of(const RobotRecord &robot, uint8_t channel, Cycles at) {
    const Sensor *sensor = sensor_on(channel);
    if (sensor == nullptr) return 0;
    return sensor->read != nullptr ? sensor->read(robot, at) : robot.context->readings[channel];
}

}  // namespace kilotwin
