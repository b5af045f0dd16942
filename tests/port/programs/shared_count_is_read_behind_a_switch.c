// expect: torn-access 29
#include <kilolib.h>
#include <string.h>

// Compiled to a table of jumps, in a function with a frame, whose begin switches interrupts off.
static volatile uint16_t heard;
static uint8_t state;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
    heard++;
}

static void setup(void) {}

static void loop(void) {
    uint8_t text[40];
    memset(text, state, sizeof text);
    switch (state) {
    case 0: state = text[3] + 1; break;
    case 1: set_motors(0, 0); break;
    case 2: delay(10); break;
    case 3: set_color(RGB(0, 1, 0)); break;
    case 4: state = rand_soft(); break;
    case 5: state = rand_hard(); break;
    case 6: set_color(text[rand_soft() & 31]); break;
    case 7:
        if (heard > 300) set_color(RGB(0, 3, 0));
        break;
    case 8: state = 1; break;
    case 9: delay(20); break;
    default: break;
    }
    state++;
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
