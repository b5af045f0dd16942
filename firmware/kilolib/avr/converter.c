#include "converter.h"

#include "board.h"
#include "infrared_receive.h"

// 1 MHz: a conversion takes 13 us. The thermometer of the chip wants it slower.
#define CLOCK (BIT(ADPS1) | BIT(ADPS0))
#define SLOW_CLOCK (BIT(ADPS2) | BIT(ADPS1) | BIT(ADPS0))
// 1.1 V, made by the chip itself. The other reference comes in at AREF.
#define INTERNAL_REFERENCE (BIT(REFS1) | BIT(REFS0))
#define ON_COMPARATOR_EDGE BIT(ADTS0)
#define ON_EDGES (BIT(ADEN) | BIT(ADATE) | CLOCK)

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
void converter_init(void) {
    DIDR0 = BIT(ADC0D) | BIT(ADC1D);
    ADCSRB = ON_COMPARATOR_EDGE;
    ADMUX = HIGH_GAIN_CHANNEL;
    ADCSRA = BIT(ADEN) | CLOCK;
    (void)convert();
    ADCSRA = ON_EDGES;
}

void converter_stop(void) { ADCSRA = 0; }

void converter_sample_on_edge(uint8_t channel) { ADMUX = channel; }

int16_t converter_sampled(void) {
    wait_for_end();
    return (int16_t)ADC;
}

// An edge in the meantime has found the converter taken: a frame with a wrong strength would come
// of it.
int16_t converter_read(uint8_t channel) {
    const uint8_t gain = ADMUX;
    ADCSRA = BIT(ADEN) | CLOCK;
    wait_for_end();
    int16_t value;
    if (channel == TEMPERATURE_CHANNEL) {
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
    if (!infrared_in_frame()) infrared_forget_edge();
    return value;
}
