/// What a robot does at present (hardware.md 1.3). Commands change it; kilo_start() acts on it.
#ifndef KILOLIB_AVR_STATES_H
#define KILOLIB_AVR_STATES_H

#include <stdint.h>

typedef enum {
    STATE_IDLE,      ///< waits and blinks green
    STATE_SETUP,     ///< RUN has come: setup(), if it never ran, then RUNNING
    STATE_RUNNING,   ///< loop()
    STATE_SLEEPING,  ///< everything off, and a look round every 8 s
    STATE_BATTERY,   ///< shows the battery's voltage on the LED
    STATE_CHARGING,  ///< blinks red while the charger is at work
    STATE_MOVING,    ///< turns its motors as READUID or CALIB says
} robot_state_t;

extern volatile robot_state_t kilolib_robot_state;

/// What MOVING does.
typedef struct {
    uint8_t left;
    uint8_t right;
} motion_t;

/// Enters MOVING, or changes the motion in it. Interrupts have to be off.
void kilolib_start_moving(motion_t next);

#endif
