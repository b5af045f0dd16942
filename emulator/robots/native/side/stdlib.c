// Functions of libc that hold state, which is private to each robot here, and that end a program.
// Weak: a program may define functions of the same names.
#include <stdlib.h>

#include "side.h"

#define WEAK __attribute__((weak))

static unsigned long rand_state = 1;
static unsigned long random_state = 1;

// The minimal standard generator of Park and Miller (CACM 1988), as in avr-libc, which replaces 0.
static unsigned long next(unsigned long state) {
    if (state == 0) state = 123459876;
    return state * 16807 % 2147483647;
}

WEAK int rand_r(unsigned int *state) {
    *state = (unsigned int)next(*state);
    return (int)(*state % (RAND_MAX + 1u));
}

WEAK int rand(void) {
    rand_state = next(rand_state);
    return (int)(rand_state % (RAND_MAX + 1ul));
}
WEAK void srand(unsigned int seed) { rand_state = seed; }

WEAK long random(void) {
    random_state = next(random_state);
    return (long)random_state;
}
WEAK void srandom(unsigned int seed) { random_state = seed; }

WEAK void exit(int status) {
    (void)status;
    kt_unusable("called exit()");
}

WEAK void abort(void) { kt_unusable("called abort()"); }
