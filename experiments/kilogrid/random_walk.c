/// The random walk of the Kilogrid's tracked runs: straight on for |N(15, 1.5)| s, a turn on the
/// spot of |N(0.5, 3)| s to either side, and so on.
#include <kilolib.h>
#include <math.h>
#include <stdlib.h>

#define STRAIGHT_MEAN_S 15.0f
#define STRAIGHT_SD_S 1.5f
#define TURN_MEAN_S 0.5f
#define TURN_SD_S 3.0f
#define TICKS_PER_SECOND 30.518f

static uint32_t leg_began;
static uint32_t leg_ticks;
static uint8_t straight;

/// Above 0, up to 1.
static float uniform(void) { return ((float)rand() + 1.0f) / ((float)RAND_MAX + 1.0f); }

/// Normally distributed, by Box and Muller.
static float normal(float mean, float sd) {
    return mean + sd * sqrtf(-2.0f * logf(uniform())) * cosf(2.0f * (float)M_PI * uniform());
}

static void next_leg(void) {
    straight = !straight;
    leg_began = kilo_ticks;
    spinup_motors();
    if (straight) {
        leg_ticks = (uint32_t)(fabsf(normal(STRAIGHT_MEAN_S, STRAIGHT_SD_S)) * TICKS_PER_SECOND);
        set_motors(kilo_straight_left, kilo_straight_right);
        set_color(RGB(0, 1, 0));
    } else {
        leg_ticks = (uint32_t)(fabsf(normal(TURN_MEAN_S, TURN_SD_S)) * TICKS_PER_SECOND);
        if (rand() & 1) {
            set_motors(kilo_turn_left, 0);
            set_color(RGB(1, 0, 0));
        } else {
            set_motors(0, kilo_turn_right);
            set_color(RGB(0, 0, 1));
        }
    }
}

static void setup(void) {
    srand((unsigned)rand_hard() << 8 | rand_hard());
    next_leg();
}

static void loop(void) {
    if (kilo_ticks - leg_began >= leg_ticks) next_leg();
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
