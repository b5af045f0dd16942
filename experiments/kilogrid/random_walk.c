/// The random walk of the Kilogrid's tracked runs: straight on for |N(15, 1.5)| s, a turn on the
/// spot of |N(0.5, 3)| s to either side, and so on. Every two seconds a report goes out, which the
/// cells of a grid may hear.
#include <kilolib.h>
#include <math.h>
#include <stdlib.h>

#define STRAIGHT_MEAN_S 15.0f
#define STRAIGHT_SD_S 1.5f
#define TURN_MEAN_S 0.5f
#define TURN_SD_S 3.0f
#define TICKS_PER_SECOND 30.518f

// As the lab's tracking library: one frame, 63 ticks after the last.
#define REPORT_TYPE 0x10
#define REPORT_TICKS 63

static message_t report;
static uint32_t reported_at;
static volatile uint8_t report_waits;
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

static message_t *next_report(void) { return report_waits ? &report : NULL; }
static void report_is_out(void) { report_waits = 0; }

static void setup(void) {
    srand((unsigned)rand_hard() << 8 | rand_hard());
    report.type = REPORT_TYPE;
    report.data[0] = (uint8_t)kilo_uid;
    report.crc = message_crc(&report);
    reported_at = kilo_ticks - (uint32_t)(rand() % REPORT_TICKS);
    next_leg();
}

static void loop(void) {
    if (kilo_ticks - leg_began >= leg_ticks) next_leg();
    if (kilo_ticks - reported_at >= REPORT_TICKS) {
        reported_at = kilo_ticks;
        report_waits = 1;
    }
}

int main(void) {
    kilo_message_tx = next_report;
    kilo_message_tx_success = report_is_out;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
