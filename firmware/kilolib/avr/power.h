/// Everything on the board that takes current, on and off.
#ifndef KILOLIB_AVR_POWER_H
#define KILOLIB_AVR_POWER_H

/// Receiver, converter, comparator and infrared LED; motors and LED stay off. Interrupts have to be
/// off.
void kilolib_power_on(void);

/// All of it, and all pins inputs.
void kilolib_power_off(void);

#endif
