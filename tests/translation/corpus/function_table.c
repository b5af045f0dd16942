// A state machine whose states are functions.
#include <kilolib.h>

typedef void (*state_t)(void);
static void go(void);
static void turn(void);
static void rest(void);
static state_t state = go;

static void show(uint8_t left, uint8_t right, uint8_t color, uint16_t ms, state_t next) {
    set_motors(left, right);
    set_color(color);
    delay(ms);
    state = next;
}

static void go(void) { show(kilo_straight_left, kilo_straight_right, RGB(0, 1, 0), 700, turn); }
static void turn(void) { show(kilo_turn_left, 0, RGB(1, 1, 0), 300, rest); }
static void rest(void) { show(0, 0, 0, 200, go); }

static void loop(void) { state(); }

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
