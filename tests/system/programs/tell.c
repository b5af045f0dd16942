#include <kilolib.h>

// Robot 1 draws a number each second; once it is large enough it tells robot 2, which tells
// robot 3, which turns red.
static message_t message;
static uint8_t told;
static uint8_t heard;
static uint8_t known;
static uint32_t last;

void note(message_t *m, distance_measurement_t *d) {
    (void)d;
    if (m->data[0] + 1 == kilo_uid && m->data[1] == 7) heard = m->data[1];
}

message_t *say(void) { return &message; }

static void tell(uint8_t what) {
    message.type = NORMAL;
    message.data[0] = (uint8_t)kilo_uid;
    message.data[1] = what;
    message.crc = message_crc(&message);
}

void setup(void) { tell(0); }

void loop(void) {
    if (kilo_uid == 1 && kilo_ticks > last + 31) {
        last = kilo_ticks;
        known = rand_soft();
        if (known > 200 && !told) {
            told = 1;
            tell(7);
        }
    }
    if (heard && !told) {
        told = 1;
        tell(heard);
        if (kilo_uid == 3) {
            set_color(RGB(3, 0, 0));
            set_motors(kilo_turn_left, 0);
        }
    }
}

int main(void) {
    kilo_init();
    kilo_message_rx = note;
    kilo_message_tx = say;
    kilo_start(setup, loop);
    return 0;
}
