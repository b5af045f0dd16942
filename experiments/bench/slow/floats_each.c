/// Computes an average that decays in each pass, of a sine.
#include <kilolib.h>
#include <math.h>

static float average, phase;

static void setup(void) {}

static void loop(void) {
    phase += 0.01f;
    if (phase > 6.28f) phase -= 6.28f;
    average = 0.99f * average + 0.01f * (float)sin(phase);
    set_color(average > 0.1f ? RGB(1, 0, 0) : average < -0.1f ? RGB(0, 0, 1) : RGB(0, 0, 0));
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
