/// Moves: straight on for 4 s, left for 2 s, right for 2 s, a rest of 1 s, and again.
///
/// LED: green straight on, red left, blue right, off at rest.
#include <kilolib.h>

typedef enum { STRAIGHT, LEFT, RIGHT, REST, MOTIONS } motion_t;

static const uint8_t SECONDS[MOTIONS] = {4, 2, 2, 1};
static const uint8_t COLOURS[MOTIONS] = {RGB(0, 3, 0), RGB(3, 0, 0), RGB(0, 0, 3), RGB(0, 0, 0)};

static motion_t motion;
static uint32_t began_at;

// An interrupt counts the four bytes up: read until two readings agree.
static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

// Legs stick. At the values that move the robot well a motor does not start by itself, so both get
// full power for 15 ms first. The values differ from robot to robot: calibration has put them into
// the EEPROM, kilo_init() reads them.
static void start(motion_t wanted) {
    motion = wanted;
    began_at = ticks_now();
    set_color(COLOURS[motion]);

    if (motion != REST) spinup_motors();
    switch (motion) {
    case STRAIGHT: set_motors(kilo_straight_left, kilo_straight_right); break;
    case LEFT: set_motors(kilo_turn_left, 0); break;  // the left motor turns the robot to the left
    case RIGHT: set_motors(0, kilo_turn_right); break;
    default: set_motors(0, 0);
    }
}

static void setup(void) { start(STRAIGHT); }

static void loop(void) {
    const uint16_t duration = (uint16_t)(SECONDS[motion] * TICKS_PER_SEC);
    if (ticks_now() - began_at < duration) return;
    start(motion + 1 < MOTIONS ? (motion_t)(motion + 1) : STRAIGHT);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
