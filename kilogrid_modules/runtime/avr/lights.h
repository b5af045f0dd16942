/// The LEDs of the cells, by a PCA9635. The rest of the API's lights is in moduleLED.h.
#ifndef MODULE_AVR_LIGHTS_H
#define MODULE_AVR_LIGHTS_H

/// Wakes the driver; all LEDs are off.
void runtime_lights_init(void);

#endif
