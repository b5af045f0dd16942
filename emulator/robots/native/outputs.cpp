#include "robots/native/outputs.h"

#include "kilolib/core/lights.h"
#include "kilolib/core/pins.h"

namespace kilotwin {

// hardware.md 1.8.
void take_outputs(RobotRecord &robot, const kt_outputs_t &outputs) {
    robot.show(led_color(static_cast<uint8_t>(outputs.ddrc & ~outputs.portc),
                         static_cast<uint8_t>(outputs.ddrd & ~outputs.portd)),
               robot.now);
    const uint8_t left = outputs.ddrb & LEFT_MOTOR_MASK ? outputs.ocr2a : 0;
    const uint8_t right = outputs.ddrd & RIGHT_MOTOR_MASK ? outputs.ocr2b : 0;
    robot.drive({robot.now, left, right});
}

}  // namespace kilotwin
