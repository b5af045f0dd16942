#include "converter.h"

#include <stdbool.h>

#include "../core/gains.h"
#include "../core/sensors.h"
#include "../core/traits.h"
#include "board.h"
#include "infrared_receive.h"

// 1 MHz: a conversion takes 13 us. The thermometer of the chip wants it slower.
#define CLOCK (BIT(ADPS1) | BIT(ADPS0))
#define SLOW_CLOCK (BIT(ADPS2) | BIT(ADPS1) | BIT(ADPS0))
// 1.1 V, made by the chip itself. The other reference comes in at AREF.
#define INTERNAL_REFERENCE (BIT(REFS1) | BIT(REFS0))
#define ON_COMPARATOR_EDGE BIT(ADTS0)
#define ON_EDGES (BIT(ADEN) | BIT(ADATE) | CLOCK)

static bool missed_edge;

static void wait_for_end(void) {
    while (ADCSRA & BIT(ADSC)) {
    }
}

static int16_t convert(void) {
    ADCSRA |= BIT(ADSC);
    wait_for_end();
    return (int16_t)ADC;
}

// The first conversion after the converter is switched on takes twice as long, and is done here.
void kilolib_converter_init(void) {
    DIDR0 = BIT(ADC0D) | BIT(ADC1D);
    ADCSRB = ON_COMPARATOR_EDGE;
    ADMUX = HIGH_GAIN_CHANNEL;
    ADCSRA = BIT(ADEN) | CLOCK;
    (void)convert();
    ADCSRA = ON_EDGES;
}

void kilolib_converter_stop(void) { ADCSRA = 0; }

void kilolib_converter_sample_on_edge(uint8_t channel) { ADMUX = channel; }

// The strength of an edge that was missed is unknown. The highest one makes estimate_distance() go
// by the low gain alone, which is sampled later.
int16_t kilolib_converter_sampled(void) {
    wait_for_end();
    const int16_t value = missed_edge ? CONVERTER_MOST : (int16_t)ADC;
    missed_edge = false;
    return value;
}

// The original waits neither for an edge's conversion nor for the reference, and does not know that
// it has missed an edge.
static int16_t original_read(uint8_t channel) {
    const bool slow = channel == SENSOR_TEMPERATURE;
    ADMUX = slow ? SENSOR_TEMPERATURE | INTERNAL_REFERENCE : channel;
    ADCSRA = BIT(ADEN) | (slow ? SLOW_CLOCK : CLOCK);
    const int16_t value = convert();
    ADMUX = HIGH_GAIN_CHANNEL;
    ADCSRA = ON_EDGES;
    return value;
}

int16_t kilolib_converter_read(uint8_t channel) {
    if (KILOLIB_ORIGINAL) return original_read(channel);
    const uint8_t gain = ADMUX;
    ADCSRA = BIT(ADEN) | CLOCK;
    wait_for_end();
    int16_t value;
    if (channel == SENSOR_TEMPERATURE) {
        ADMUX = channel | INTERNAL_REFERENCE;
        ADCSRA = BIT(ADEN) | SLOW_CLOCK;
        (void)convert();  // the reference settles
        value = convert();
    } else {
        ADMUX = channel;
        value = convert();
    }
    ADMUX = gain;
    ADCSRA = ON_EDGES;
    missed_edge = !kilolib_infrared_in_frame() && kilolib_infrared_receiving();
    return value;
}
