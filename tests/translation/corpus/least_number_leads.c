// The least number heard leads; who has not heard of it for long asks again.
#include <kilolib.h>

static message_t message;
static volatile uint16_t heard = 0xFFFF;
static uint16_t leader;
static uint32_t last;

static message_t *message_tx(void) { return &message; }

static void message_rx(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    heard = received->data[0] | received->data[1] << 8;
}

static void tell(uint16_t number) {
    leader = number;
    message.data[0] = number & 0xFF;
    message.data[1] = number >> 8;
    message.crc = message_crc(&message);
    set_color(leader == kilo_uid ? RGB(0, 0, 1) : RGB(1, 0, 0));
}

static void loop(void) {
    const uint16_t number = heard;
    if (number <= leader) {
        if (number < leader) tell(number);
        last = kilo_ticks;
    }
    if (kilo_ticks - last > 90) {
        heard = 0xFFFF;
        tell(kilo_uid);
        last = kilo_ticks;
    }
}

static void setup(void) { tell(kilo_uid); }

int main(void) {
    kilo_init();
    kilo_message_rx = message_rx;
    kilo_message_tx = message_tx;
    kilo_start(setup, loop);
    return 0;
}
