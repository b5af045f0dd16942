// _delay_ms() and its kin take the time they say; the timers tell it too.
#define F_CPU 8000000UL
#include <avr/io.h>
#include <util/delay.h>

#include "check.h"

#define TICK_MS 32.768

static void begin_of_tick(void) {
    const uint32_t tick = kilo_ticks;
    while (kilo_ticks == tick) {
    }
}

static void check(void) {
    begin_of_tick();
    uint32_t before = kilo_ticks;
    _delay_ms(10 * TICK_MS + 1);
    CHECK(kilo_ticks - before == 10);

    begin_of_tick();
    before = kilo_ticks;
    for (uint8_t i = 0; i < 100; i++) _delay_us(1000);
    CHECK(kilo_ticks - before == 3);

    begin_of_tick();
    CHECK(TCNT0 < 2);
    _delay_ms(TICK_MS / 2);
    CHECK(TCNT0 >= 127 && TCNT0 <= 130);

    begin_of_tick();
    before = kilo_ticks;
    for (uint8_t i = 0; i < 8; i++) _delay_loop_2(0);  // 8 of 262,144 cycles
    CHECK(kilo_ticks - before == 8);
    _delay_loop_1(255);

    begin_of_tick();
    const uint16_t timer1 = TCNT1;
    _delay_ms(1);
    CHECK(TCNT1 != timer1);
}
