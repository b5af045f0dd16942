// Does what messages say (support.h); prints whatever else it hears, when asked to.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

enum { MOTORS = 0x20, COLOR, SEND, SAY };

static message_t out;
static uint8_t says;

static void obey(message_t *message, distance_measurement_t *distance) {
    const uint8_t *data = message->data;
    switch (message->type) {
    case MOTORS: set_motors(data[0], data[1]); break;
    case COLOR: set_color(data[0]); break;
    case SEND:
        out.type = data[0];
        out.data[0] = (uint8_t)kilo_uid;
        out.crc = message_crc(&out) ^ data[1];
        break;
    case SAY: says = data[0]; break;
    default:
        if (says) printf("%u: %u %u, %d mm", message->type, data[0], data[1], distance->high_gain);
    }
}

static message_t *send(void) { return out.type ? &out : NULL; }
static void nothing(void) {}

int main(void) {
    kilo_message_rx = obey;
    kilo_message_tx = send;
    kilo_init();
    kilo_start(nothing, nothing);
    return 0;
}
