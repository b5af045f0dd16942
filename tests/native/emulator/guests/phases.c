// Waits for ticks in loops whose state comes back after a number of turns, and tells by prints and
// motors in which of them it was when the time had come. Another kind of loop for each uid.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static volatile uint16_t phase;
static volatile uint8_t heard;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
}

static void wait_in_turns(uint16_t turns, uint32_t until) {
    while (kilo_ticks < until) phase = (uint16_t)((phase + 1) % turns);
}

// Each turn of it can be told from outside.
static void wait_with_effects(uint8_t kind, uint32_t until) {
    static uint8_t printed;
    while (kilo_ticks < until) {
        phase = !phase;
        if (kind == 0) set_motors(phase ? 100 : 0, 0);
        if (kind == 1) set_color(phase ? RGB(1, 0, 0) : RGB(0, 1, 0));
        if (kind == 2 && printed < 200) printf("%u", printed++);
        if (kind == 3) kilo_ticks ^= phase;
    }
}

// The sum lies in registers of the floating-point unit alone.
static void add_up(void) {
    long double sum = 0;
    while (sum < 300) sum += 1;
    printf("sum %d", (int)sum);
}

static void loop(void) {
    static const uint16_t TURNS[] = {1, 2, 3, 7, 8, 40, 97, 300, 511, 513, 700};
    const uint8_t kinds = sizeof TURNS / sizeof TURNS[0];
    const uint8_t before = heard;
    const uint32_t until = kilo_ticks + 2 + rand_soft() % 4;
    const uint8_t kind = (uint8_t)(kilo_uid % (kinds + 6));
    if (kind < kinds)
        wait_in_turns(TURNS[kind], until);
    else if (kind < kinds + 4)
        wait_with_effects((uint8_t)(kind - kinds), until);
    else if (kind == kinds + 4)
        while (heard == before && kilo_ticks < until + 20) phase++;
    else
        wait_in_turns(5, until);
    if (kind == kinds + 5) add_up();
    printf("%u at %lu, heard %u", phase, (unsigned long)kilo_ticks, heard);
}

static void setup(void) { rand_seed((uint8_t)kilo_uid); }

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
