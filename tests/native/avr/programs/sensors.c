// Reads battery, light and temperature by single conversions, 64 times each.
#include <avr/io.h>

volatile uint16_t battery[64], light[64], temperature[64];
volatile uint8_t done, charging;

static uint16_t convert(uint8_t mux) {
    ADMUX = mux;
    ADCSRA |= 1 << ADSC;
    while ((ADCSRA & 1 << ADSC) != 0) {
    }
    return ADC;
}

int main(void) {
    ADCSRA = 1 << ADEN | 1 << ADPS1 | 1 << ADPS0;
    for (uint8_t i = 0; i < 64; i++) {
        battery[i] = convert(6);
        light[i] = convert(7);
        temperature[i] = convert(1 << REFS1 | 1 << REFS0 | 8);
    }
    done = 1;
    for (;;) charging = (PIND & 1 << 0) == 0;
}
