// Sleeps in power-down until the watchdog's interrupt, twice; then lets the watchdog reset it.
// Counts its starts in the EEPROM. Timer 0 would interrupt 31 times per second, but stands still
// meanwhile.
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#define STARTS ((uint8_t *)0x100)

volatile uint8_t wakes, starts, cause, ticks;

ISR(WDT_vect) { wakes++; }
ISR(TIMER0_COMPA_vect) { ticks++; }

static void watchdog(uint8_t mode) {
    cli();
    wdt_reset();
    WDTCSR = 1 << WDCE | 1 << WDE;
    WDTCSR = mode;
    sei();
}

int main(void) {
    cause = MCUSR;
    MCUSR = 0;
    starts = (uint8_t)(eeprom_read_byte(STARTS) + 1);
    eeprom_write_byte(STARTS, starts);
    if (starts != 0) {  // erased EEPROM: 0xFF + 1
        watchdog(0);
        for (;;) {
        }
    }
    TCCR0B = 1 << CS02 | 1 << CS00;
    TIMSK0 = 1 << OCIE0A;
    set_sleep_mode(SLEEP_MODE_PWR_DOWN);
    while (wakes < 2) {
        watchdog(1 << WDIE | 1 << WDP2 | 1 << WDP1);  // 1 s
        sleep_mode();
    }
    watchdog(1 << WDE | 1 << WDP2 | 1 << WDP1);
    for (;;) {
    }
}
