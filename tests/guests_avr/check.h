/// For guests that check themselves: each defines check(), which runs as setup(). What is wrong is
/// printed as "FAIL file:line what", and "passed" at the end, always.
#ifndef GUESTS_AVR_CHECK_H
#define GUESTS_AVR_CHECK_H

#define DEBUG
#include <debug.h>
#include <kilolib.h>

#define CHECK(condition)                                                             \
    do {                                                                             \
        if (!(condition)) printf("FAIL %s:%d %s\n", __FILE__, __LINE__, #condition); \
    } while (0)

static void check(void);

static void setup(void) {
    check();
    printf("passed\n");
}

static void loop(void) {}

int main(void) {
    debug_init();
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}

#endif
