#include "sleep.h"

#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/delay.h>

#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "kilolib.h"
#include "power.h"

#define SETTLE_US 300
#define LISTEN_MS 10
#define LISTEN_ON_MS 100

// It only has to wake the processor.
EMPTY_INTERRUPT(WDT_vect)

static void power_down(void) {
    cli();
    power_off();
    wdt_reset();
    WDTCSR = BIT(WDCE) | BIT(WDE);
    WDTCSR = BIT(WDIE) | BIT(WDP3) | BIT(WDP0);  // an interrupt after 8 s, no reset
    SMCR = BIT(SM1) | BIT(SE);                   // power-down
    sleep_bod_disable();
    sei();
    sleep_cpu();
    SMCR = 0;
    wdt_disable();
}

void sleep_for_8_s(void) {
    power_down();
    cli();
    power_on();
    sei();
    _delay_us(SETTLE_US);
    (void)infrared_heard();
    set_color(RGB(3, 3, 3));
    delay(LISTEN_MS);
    if (infrared_heard()) {
        set_color(RGB(3, 0, 0));
        delay(LISTEN_ON_MS);
    }
    set_color(0);
}
