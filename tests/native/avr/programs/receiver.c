// Notes when the comparator trips and what the converter made of that pulse. The first pulse is
// measured on the high gain, the second on the low gain.
#include <avr/interrupt.h>
#include <avr/io.h>

volatile uint8_t pulses;
volatile uint16_t times[8];
volatile uint16_t readings[8];
volatile uint8_t level;

ISR(ANALOG_COMP_vect) {
    const uint8_t n = pulses & 7;
    times[n] = TCNT1;
    while ((ADCSRA & 1 << ADSC) != 0) {
    }
    readings[n] = ADC;
    ADMUX = 1;
    pulses++;
}

int main(void) {
    DDRD = PORTD = 1 << 2;  // power for the receiver
    ADMUX = 0;
    ADCSRA = 1 << ADEN | 1 << ADATE | 1 << ADPS1 | 1 << ADPS0;
    ADCSRB = 1 << ADTS0;
    TCCR1B = 1 << CS10;
    ACSR = 1 << ACI | 1 << ACIE | 1 << ACIS1 | 1 << ACIS0;
    sei();
    for (;;) level = (ACSR & 1 << ACO) != 0;
}
