// Counts passes by numbers of several widths, up and down, and asks for them in several ways; what
// it hears changes the number that it adds.
#include <kilolib.h>

static uint8_t turns;
static int16_t down = 20000;
static uint16_t sum;
static uint32_t all;
static volatile uint8_t step = 1;
static uint8_t color;
static message_t message;

static message_t *message_tx(void) { return &message; }
static void message_rx(message_t *m, distance_measurement_t *d) {
    (void)d;
    step = m->data[0];
}

static void show(uint8_t by) {
    color += by;
    set_color(color & 63);
}

static void setup(void) {
    message.type = NORMAL;
    message.data[0] = 1 + (kilo_uid & 3);
    message.crc = message_crc(&message);
}

static void loop(void) {
    sum += step;
    down -= 3;
    if (down < -9000) {
        down = 15000;
        show(1);
    }
    if ((++all & 0x3FFF) == 0x2A00) show(3);
    if (all >= 3000000) all = 0;
    if (sum > 40000u) return;
    turns++;
    if (turns == 200) show(5);
}

int main(void) {
    kilo_init();
    kilo_message_tx = message_tx;
    kilo_message_rx = message_rx;
    kilo_start(setup, loop);
    return 0;
}
