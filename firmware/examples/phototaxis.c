/// Goes to the light, with one sensor that knows nothing of directions.
///
/// A turn leads forwards along an arc, so that it gets brighter for half of a circle and darker for
/// the other. The robot turns to one side until it has become brighter and begins to get darker
/// again, then it turns to the other side. Arc by arc it comes nearer, and ends in circles round
/// the light.
///
/// LED: red while it turns left, green while it turns right.
#include <kilolib.h>
#include <stdbool.h>

#define SAMPLES 8      // added up, one in each tick: the noise becomes smaller that way
#define NOISE_SUM 12   // a smaller change of the sum says nothing
#define PAUSE_TICKS 4  // loop() was not called for so long: there was a pause

static uint32_t last_tick;
static uint8_t samples;
static uint16_t sum;

static bool left;
static bool brightening;
static uint16_t extreme;  // the brightest while it gets brighter, else the darkest

static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static void turn(bool to_left) {
    left = to_left;
    set_color(left ? RGB(3, 0, 0) : RGB(0, 3, 0));
    spinup_motors();
    set_motors(left ? kilo_turn_left : 0, left ? 0 : kilo_turn_right);
}

static void decide(uint16_t brightness) {
    const bool further = brightening ? brightness > extreme : brightness < extreme;
    const uint16_t back = (uint16_t)(brightening ? extreme - brightness : brightness - extreme);
    if (further) {
        extreme = brightness;
    } else if (back > NOISE_SUM) {
        extreme = brightness;
        brightening = !brightening;
        if (!brightening) turn(!left);
    }
}

static void setup(void) {
    last_tick = ticks_now();
    turn(true);
}

static void loop(void) {
    const uint32_t now = ticks_now();
    if (now == last_tick) return;
    if (now - last_tick > PAUSE_TICKS) turn(left);  // a pause switches the motors off
    last_tick = now;

    const int16_t light = get_ambientlight();
    if (light < 0) return;  // a message is being received, which needs the same converter
    sum = (uint16_t)(sum + (uint16_t)light);
    if (++samples < SAMPLES) return;

    decide(sum);
    samples = 0;
    sum = 0;
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
