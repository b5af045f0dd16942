/// The analog-digital converter: two gains of infrared light, and single voltages.
#ifndef KILOLIB_AVR_CONVERTER_H
#define KILOLIB_AVR_CONVERTER_H

#include <stdint.h>

void converter_init(void);
void converter_stop(void);

/// From now on each edge of the comparator starts a conversion of this channel.
void converter_sample_on_edge(uint8_t channel);

/// What the last edge's conversion yields, 0..1023. Waits for its end, up to 14 us.
int16_t converter_sampled(void);

/// Converts one channel, 0..1023, in 16 us (430 us for the temperature). Interrupts have to be off.
/// A frame that begins meanwhile is lost.
int16_t converter_read(uint8_t channel);

#endif
