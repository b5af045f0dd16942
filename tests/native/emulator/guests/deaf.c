// Turns interrupts off in one call of loop(), and on again four calls later.
#define DEBUG
#include <avr/interrupt.h>
#include <debug.h>
#include <kilolib.h>

#define OFF_IN 5
#define ON_IN 9
#define LAST 12

static void setup(void) {}

static void loop(void) {
    static int calls;
    if (++calls > LAST) return;
    if (calls == OFF_IN) cli();
    if (calls == ON_IN) sei();
    printf("%d at %lu", calls, (unsigned long)kilo_ticks);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
