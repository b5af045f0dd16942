/// Driver of the cells' LEDs, by a PCA9635. The API's functions are declared in moduleLED.h; each
/// takes 0.5 ms a cell on the I2C bus.
#ifndef MODULE_AVR_LIGHTS_H
#define MODULE_AVR_LIGHTS_H

/// Wakes the LED driver; all LEDs are off.
void runtime_lights_init(void);

#endif
