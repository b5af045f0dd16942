#include "kilob_gradient.h"

#include <math.h>
#include <stdbool.h>

#include "kilo_rand_lib.h"

#define MOST 4

typedef struct {
    uint8_t low, high;
} range_t;

// `before` and `now` are what was received in the last period and in this one.
typedef struct {
    uint8_t byte;  // of the message
    uint8_t (*is_wrong)(uint8_t, uint8_t);
    void (*on_escape)(void);
    bool can_stick, escaped, fresh;
    range_t before, now;
    uint32_t since;  // when it was met; 0: not met
} gradient_t;

// No value has been received: any is lower and higher.
static const range_t NOTHING = {0xFF, 0};

static gradient_t gradients[MOST];
static uint8_t count;
static bool turning;
static direction_t side = UNDEFINED;
static uint32_t look_at;
static uint32_t period, stuck;
static double small_mu, small_sigma, large_mu, large_sigma;

static uint32_t ticks(double seconds) { return (uint32_t)(seconds * TICKS_PER_SEC); }

void kilob_gradient_tracking_init(double check_period_s, double turn_small_mu_s,
                                  double turn_small_sigma_s, double turn_large_mu_s,
                                  double turn_large_sigma_s, double stuck_timeout_s) {
    period = ticks(check_period_s);
    small_mu = floor(turn_small_mu_s * TICKS_PER_SEC);
    small_sigma = floor(turn_small_sigma_s * TICKS_PER_SEC);
    large_mu = floor(turn_large_mu_s * TICKS_PER_SEC);
    large_sigma = floor(turn_large_sigma_s * TICKS_PER_SEC);
    stuck = ticks(stuck_timeout_s);
    turning = false;
    count = 0;
}

void kilob_gradient_tracking_config_add(uint8_t gradient_idx,
                                        uint8_t (*direction)(uint8_t, uint8_t),
                                        void (*on_escape)(void), uint8_t can_stuck) {
    if (count == MOST) return;
    const gradient_t added = {gradient_idx, direction, on_escape, can_stuck != 0, false, false,
                              NOTHING,      NOTHING,   0};
    gradients[count++] = added;
}

void kilob_gradient_tracking_reset(void) {
    count = 0;
    look_at = kilo_ticks + period;
}

uint8_t kilob_gradient_has_active(void) {
    for (uint8_t i = 0; i < count; i++)
        if (!gradients[i].escaped) return 1;
    return 0;
}

uint8_t kilob_gradient_tracking_decreasing(uint8_t gradient, uint8_t value) {
    return value != 0 && value > gradients[gradient].before.high;
}

uint8_t kilob_gradient_tracking_increasing(uint8_t gradient, uint8_t value) {
    return value != 0 && value < gradients[gradient].before.low;
}

// A side once drawn is kept until all gradients are escaped: else the robot would turn to and fro.
static void turn(double mu, double sigma) {
    turning = true;
    if (side == UNDEFINED) side = g_ran_uniform() < 0.5 ? RIGHT : LEFT;
    if (side == LEFT)
        turn_left();
    else
        turn_right();
    look_at = kilo_ticks + (uint32_t)fabs(g_ran_gaussian(mu, sigma));
}

static void begin_period(void) {
    for (uint8_t i = 0; i < count; i++) {
        gradients[i].before = gradients[i].now;
        gradients[i].now = NOTHING;
    }
}

// Whether the values stayed as they were, so that the robot goes across.
static bool look(gradient_t *gradient) {
    const range_t *now = &gradient->now, *before = &gradient->before;
    const bool same = before->low != 0 && before->high != 0 && before->low == now->low &&
                      before->high == now->high;
    if (now->high == 0) {
        gradient->escaped = true;
        gradient->since = 0;
        gradient->on_escape();
    }
    if (gradient->can_stick && gradient->since > 0 && kilo_ticks - gradient->since > stuck) {
        side = side == LEFT ? RIGHT : LEFT;
        gradient->since = kilo_ticks;
    }
    gradient->fresh = false;
    return same;
}

// A turn ends where a look would be due; what was received on the way says nothing.
void kilob_gradient_tracking(void) {
    if (kilo_ticks < look_at) return;
    if (turning) {
        begin_period();
        move_straight();
        turning = false;
        look_at = kilo_ticks + period;
        return;
    }
    bool across = false;
    for (uint8_t i = 0; i < count; i++)
        if (gradients[i].fresh) across |= look(&gradients[i]);
    // The next gradient is met from anywhere.
    if (!kilob_gradient_has_active()) side = UNDEFINED;
    begin_period();
    look_at = kilo_ticks + period;
    if (across) turn(small_mu, small_sigma);
}

// In the receiver's interrupt: a wrong value turns the robot at once, which pushes its motors for
// 20 ms and keeps the interrupts off for as long.
void kilob_gradient_tracking_message_received(IR_message_t *message,
                                              distance_measurement_t *distance) {
    (void)distance;
    for (uint8_t i = 0; i < count; i++) {
        gradient_t *gradient = &gradients[i];
        const uint8_t value = message->data[gradient->byte];
        gradient->fresh = true;
        if (value > 0) {
            gradient->escaped = false;
            if (gradient->since == 0) gradient->since = kilo_ticks;
        }
        if (value < gradient->now.low) gradient->now.low = value;
        if (value > gradient->now.high) gradient->now.high = value;
        if (!turning && gradient->is_wrong(i, value)) turn(large_mu, large_sigma);
    }
}
