#include "kilob_random_walk.h"

typedef enum { NEW_LEG, STRAIGHT_ON, TURNING } phase_t;

static phase_t phase = NEW_LEG;
static uint32_t phase_end;
// In seconds, and no macros: labs' programs define RW_FORWARD_MU and the like themselves.
static double forward_mu = 3.0;
static double forward_sigma = 1.5;
static double rotation_mu = 1.5;
static double rotation_span = 3.0;

void kilob_random_walk_init(double forward_mu_s, double forward_sigma_s, double rotation_mu_s,
                            double rotation_span_s) {
    forward_mu = forward_mu_s;
    forward_sigma = forward_sigma_s;
    rotation_mu = rotation_mu_s;
    rotation_span = rotation_span_s;
    kilob_random_walk_reset();
}

void kilob_random_walk_reset(void) { phase = NEW_LEG; }

// Whole seconds, rounded down, so that a phase of no time occurs: it ends with the next tick.
static void begin(phase_t next, double mu, double sigma) {
    phase = next;
    phase_end = kilo_ticks + INT_GAUSSIAN_TICKS(mu, sigma);
}

void kilob_random_walk(void) {
    if (phase == NEW_LEG) {
        begin(STRAIGHT_ON, forward_mu, forward_sigma);
        move_straight();
    } else if (kilo_ticks <= phase_end) {
        return;
    } else if (phase == TURNING) {
        // The next leg begins with the next call, as in the labs' library.
        phase = NEW_LEG;
    } else {
        begin(TURNING, rotation_mu, rotation_span);
        if (g_ran_uniform() > 0.5)
            turn_left();
        else
            turn_right();
    }
}
