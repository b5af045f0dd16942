// Means harm to the sweep that it is a trial of, in the way WAY; ways: test_hostile_sweep.py.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "system_call.h"

static uint8_t done;

static void harm(void) {
    switch (WAY) {
    case 1: call(2, (long)OUTSIDE "/new", 0102, 0644, 0); break;  // open
    case 2: call(87, (long)VICTIM, 0, 0, 0); break;               // unlink
    case 3: call(62, call(110, 0, 0, 0, 0), 9, 0, 0); break;      // kill, getppid
    case 4: call(231, 0, 0, 0, 0); break;                         // exit_group
    case 5: *(volatile long *)0x10 = 0; break;
    case 6:
        for (long i = 3; i < 100; i++) call(1, i, (long)"{\"cpu_s\": 1}\n", 13, 0);  // write
        call(231, 0, 0, 0, 0);
        break;
    default: break;
    }
}

static void setup(void) {}

static void loop(void) {
    if (!done) harm();
    done = 1;
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
