/// A Kilobot API that does nothing but remember. The test plays the runtime: it calls fake_setup,
/// fake_loop and the callbacks, and counts kilo_ticks up.
#ifndef FIRMWARE_TESTS_FAKE_KILOLIB_H
#define FIRMWARE_TESTS_FAKE_KILOLIB_H

#include <kilolib.h>

typedef struct {
    uint8_t left;
    uint8_t right;
    uint8_t colour;
    int set_motors_calls;
    int spinup_calls;
    int set_color_calls;
    int rand_hard_calls;
    int delayed_ms;
} fake_robot_t;

extern fake_robot_t fake;
extern void (*fake_setup)(void);
extern void (*fake_loop)(void);

/// A robot fresh from the factory: uid 42, everything off, tick 0.
void fake_reset(void);

#endif
