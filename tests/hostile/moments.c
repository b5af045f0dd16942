// Does one harmful act, ACT, at one moment of a robot's life, MOMENT; test_moments.py has their
// names, and says what becomes of each.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "acts.h"

#define AT(moment) \
    if (MOMENT == (moment)) harm()

#ifndef __x86_64__
#undef MOMENT
#define MOMENT 0  // none on a robot
#endif

#if MOMENT == 1  // a function that is chosen when the program is loaded
static void chosen(void) {}
static void *choose(void) {
    harm();
    return (void *)chosen;
}
void by_choice(void) __attribute__((ifunc("choose")));
#elif MOMENT == 2  // code among that which a loader runs first
__attribute__((used, section(".init"))) static void first(void) { harm(); }
#elif MOMENT == 3
void _init(void) { harm(); }
#elif MOMENT == 4
void _fini(void) { harm(); }
#endif

__attribute__((constructor)) static void constructor(void) { AT(5); }
__attribute__((destructor)) static void destructor(void) { AT(6); }

static message_t out;

static message_t *to_send(void) {
    AT(7);
    return &out;
}
static void sent(void) { AT(8); }
static void received(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    AT(9);
}

static void setup(void) {
    AT(10);
    out.crc = message_crc(&out);
}

static void loop(void) {
    AT(11);
    printf("did %d", did);
    delay(200);
    AT(12);
}

int main(void) {
    AT(13);
    kilo_init();
    debug_init();
    kilo_message_tx = to_send;
    kilo_message_tx_success = sent;
    kilo_message_rx = received;
#if MOMENT == 1
    by_choice();
#endif
    AT(14);
    kilo_start(setup, loop);
    return 0;
}
