// Tells the steps of its life.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static int lives;
static int loops;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    printf("heard %u in loop %d", message->type, loops);
    if (message->type == 0x31) set_motors(70, 70);
}

static void setup(void) {
    printf("setup at %lu", (unsigned long)kilo_ticks);
    set_motors(70, 70);
    set_color(RGB(0, 3, 0));
}

static void loop(void) {
    static uint32_t last;
    if (kilo_ticks == last) return;
    last = kilo_ticks;
    loops++;
    if (last % 10 == 0) printf("loop %d at %lu", loops, (unsigned long)last);
}

int main(void) {
    kilo_message_rx = on_message;
    lives++;
    kilo_init();
    printf("main, life %d, ticks %lu", lives, (unsigned long)kilo_ticks);
    kilo_start(setup, loop);
    return 0;
}
