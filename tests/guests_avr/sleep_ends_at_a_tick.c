// Sleep lasts up to a tick; without sleep_enable() it does not begin.
#include <avr/interrupt.h>
#include <avr/power.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "check.h"

static void check(void) {
    wdt_enable(WDTO_2S);
    wdt_reset();
    wdt_disable();
    power_adc_disable();
    power_all_enable();

    uint32_t before = kilo_ticks;
    sleep_cpu();
    CHECK(kilo_ticks == before);

    set_sleep_mode(SLEEP_MODE_IDLE);
    for (uint8_t i = 0; i < 10; i++) sleep_mode();
    CHECK(kilo_ticks - before == 10);

    before = kilo_ticks;
    sleep_enable();
    sei();
    sleep_cpu();
    sleep_disable();
    CHECK(kilo_ticks - before == 1);

    asm volatile("cli");
    __asm__ __volatile__("wdr\n\tnop\n\tsei" ::: "memory");
    CHECK(kilo_ticks - before == 1);
}
