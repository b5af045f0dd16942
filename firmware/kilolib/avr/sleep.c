#include "sleep.h"

#include <avr/interrupt.h>
#include <avr/sleep.h>
#include <util/delay.h>

#include "../core/sleep_rhythm.h"
#include "board.h"
#include "converter.h"
#include "infrared_receive.h"
#include "kilolib.h"
#include "power.h"
#include "watchdog.h"

// It only has to wake the processor.
EMPTY_INTERRUPT(WDT_vect)

// Interrupts are off when it comes back.
static void power_down(void) {
    cli();
    kilolib_power_off();
    watchdog_ring_in_8_s();
    SMCR = BIT(SM1) | BIT(SE);  // power-down
    sleep_bod_disable();
    sei();
    sleep_cpu();
    SMCR = 0;
    cli();
    watchdog_stop();
}

void kilolib_sleep_for_8_s(void) {
    power_down();
    kilolib_power_on();
    sei();
    _delay_us(SLEEP_SETTLE_US);
    (void)kilolib_infrared_frame_began();
    set_color(SLEEP_LISTEN_COLOR);
    delay(SLEEP_LISTEN_MS);
    if (kilolib_infrared_frame_began()) {
        set_color(SLEEP_LISTEN_ON_COLOR);
        delay(SLEEP_LISTEN_ON_MS);
    }
    set_color(0);
}
