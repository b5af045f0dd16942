// Reads its light in the sleep that is meant for that, then sleeps deeply until the watchdog, then
// has its receiver off.
#define F_CPU 8000000UL
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/delay.h>

volatile uint8_t conversions, ticks, edges, asleep;
volatile uint16_t reading;

ISR(ADC_vect) { conversions++; }
ISR(ANALOG_COMP_vect) { edges++; }
ISR(TIMER0_COMPA_vect) { ticks++; }
ISR(WDT_vect) { wdt_disable(); }

int main(void) {
    DDRD = PORTD = 1 << 2;  // power for the receiver
    TCCR0B = 1 << CS00;
    OCR0A = 200;
    ADMUX = 7;
    ADCSRA = 1 << ADEN | 1 << ADIE | 1 << ADPS2 | 1 << ADPS1 | 1 << ADPS0;
    set_sleep_mode(SLEEP_MODE_ADC);
    for (uint8_t i = 0; i < 8; i++) {
        TCNT0 = 0;
        TIFR0 = 1 << OCF0A;
        TIMSK0 = 1 << OCIE0A;
        sei();
        sleep_mode();
        cli();
        TIMSK0 = 0;
    }
    reading = ADC;
    ADCSRA = 0;
    ACSR = 1 << ACIE | 1 << ACI | 1 << ACIS1 | 1 << ACIS0;
    asleep = 1;
    wdt_enable(WDTO_120MS);
    WDTCSR |= 1 << WDIE;
    set_sleep_mode(SLEEP_MODE_PWR_DOWN);
    sei();
    sleep_mode();
    asleep = 0;
    _delay_ms(60);
    PORTD = 0;
    asleep = 2;
    for (;;) {
    }
}
