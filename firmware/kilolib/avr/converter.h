/// The analog-digital converter: two gains of infrared light, and single voltages.
#ifndef KILOLIB_AVR_CONVERTER_H
#define KILOLIB_AVR_CONVERTER_H

#include <stdint.h>

void kilolib_converter_init(void);
void kilolib_converter_stop(void);

/// From now on each edge of the comparator starts a conversion of this channel.
void kilolib_converter_sample_on_edge(uint8_t channel);

/// Result of the conversion at the last edge, 0..1023. Waits for its end, up to 14 us. 1023 if the
/// converter was taken by kilolib_converter_read() at that time.
int16_t kilolib_converter_sampled(void);

/// Converts one channel, 0..1023, in 16 us (430 us for the temperature). Interrupts have to be off.
int16_t kilolib_converter_read(uint8_t channel);

#endif
