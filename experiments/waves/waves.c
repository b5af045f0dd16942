/// Waves: colours go round among robots that stand still, and spirals form out of noise.
///
/// Each robot is at one of 18 places on a circle of colours, the first one by chance. Whenever it
/// hears a robot that is one or two places ahead it goes on by one. So a colour runs through the
/// swarm as a wave, and where waves break they roll up: a spiral, which drives all around it.
///
/// LED: the place, from red by yellow, green, cyan, blue and magenta back to red.
#include <kilolib.h>

#define TYPE_PLACE 2

static const uint8_t COLOURS[] = {
    RGB(3, 0, 0), RGB(3, 1, 0), RGB(3, 2, 0), RGB(3, 3, 0), RGB(2, 3, 0), RGB(1, 3, 0),
    RGB(0, 3, 0), RGB(0, 3, 1), RGB(0, 3, 2), RGB(0, 3, 3), RGB(0, 2, 3), RGB(0, 1, 3),
    RGB(0, 0, 3), RGB(1, 0, 3), RGB(2, 0, 3), RGB(3, 0, 3), RGB(3, 0, 2), RGB(3, 0, 1),
};
#define PLACES ((uint8_t)sizeof COLOURS)

static message_t message;
static volatile uint8_t place;

static void on_message(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    if (received->type != TYPE_PLACE || received->data[0] >= PLACES) return;
    const uint8_t ahead = (uint8_t)((received->data[0] + PLACES - place) % PLACES);
    if (ahead == 1 || ahead == 2) place = (uint8_t)((place + 1) % PLACES);
}

static message_t *on_transmit(void) {
    message.type = TYPE_PLACE;
    message.data[0] = place;
    message.crc = message_crc(&message);
    return &message;
}

static void setup(void) {
    place = rand_hard() % PLACES;
    kilo_message_rx = on_message;
}

static void loop(void) { set_color(COLOURS[place]); }

int main(void) {
    kilo_message_tx = on_transmit;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
