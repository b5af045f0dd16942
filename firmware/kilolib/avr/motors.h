/// The two vibration motors: timer 2 makes their pulses, the direction of the pins lets them out.
#ifndef KILOLIB_AVR_MOTORS_H
#define KILOLIB_AVR_MOTORS_H

/// Starts the timer; the motors stay off.
void kilolib_motors_init(void);

/// Makes the motors' pins outputs: set_motors() has effect from now on. Both duties are 0.
void kilolib_motors_on(void);

/// Makes the motors' pins inputs, both duties 0: set_motors() has no effect until
/// kilolib_motors_on().
void kilolib_motors_off(void);

#endif
