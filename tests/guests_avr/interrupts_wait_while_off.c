// Ticks do not come between cli() and sei(), however long that is, and one comes right after it.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "check.h"

// Compiles, and is never called.
EMPTY_INTERRUPT(PCINT0_vect)
ISR(TIMER1_OVF_vect) { set_color(RGB(3, 3, 3)); }

static uint32_t ticks_of(void (*wait)(void)) {
    const uint32_t before = kilo_ticks;
    wait();
    return kilo_ticks - before;
}

static void open(void) { delay(200); }

static void closed(void) {
    cli();
    const uint32_t before = kilo_ticks;
    delay(200);
    CHECK(kilo_ticks == before);
    sei();
}

static void saved(void) {
    const uint8_t sreg = SREG;
    cli();
    CHECK(bit_is_clear(SREG, SREG_I));
    delay(200);
    SREG = sreg;
    delay(70);
}

static void atomic(void) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        CHECK(bit_is_clear(SREG, SREG_I));
        delay(200);
        return;
    }
}

static void nested(void) {
    ATOMIC_BLOCK(ATOMIC_FORCEON) {
        ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {}
        CHECK(bit_is_clear(SREG, SREG_I));
        NONATOMIC_BLOCK(NONATOMIC_RESTORESTATE) { delay(200); }
        CHECK(bit_is_clear(SREG, SREG_I));
    }
}

static void check(void) {
    CHECK(bit_is_set(SREG, SREG_I));
    CHECK(ticks_of(open) >= 6);
    CHECK(ticks_of(closed) == 1);
    const uint32_t ticks = ticks_of(saved);
    CHECK(ticks >= 3 && ticks <= 4);
    CHECK(ticks_of(atomic) == 1);
    CHECK(ticks_of(nested) >= 6);
    CHECK(bit_is_set(SREG, SREG_I));
}
