/// The two vibration motors: timer 2 makes their pulses, the direction of the pins lets them out.
#ifndef KILOLIB_AVR_MOTORS_H
#define KILOLIB_AVR_MOTORS_H

/// Starts the timer; the motors stay off.
void kilolib_motors_init(void);

/// Lets the motors turn as set_motors() says from now on; until then they stand still.
void kilolib_motors_on(void);

/// Stops the motors, whatever set_motors() says, until kilolib_motors_on().
void kilolib_motors_off(void);

#endif
