/// Says its uid to all twice a second, and counts what it hears of each until it is told to stop;
/// then prints how many frames it has sent, and the counts, a line of `uid frames` each.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#define ROBOTS 25
#define STOP 9  // a message's type

static message_t message;
static uint16_t heard[ROBOTS + 1], sent;
static volatile uint8_t stopped;
static uint8_t told;

static message_t *on_transmit(void) { return &message; }

static void on_sent(void) {
    if (!stopped) sent++;
}

static void on_message(message_t *m, distance_measurement_t *distance) {
    (void)distance;
    if (m->type == STOP) stopped = 1;
    if (!stopped && m->data[0] <= ROBOTS) heard[m->data[0]]++;
}

static void setup(void) {
    debug_init();
    message.data[0] = (uint8_t)kilo_uid;
    message.crc = message_crc(&message);
}

static void loop(void) {
    if (told || !stopped) return;
    told = 1;
    printf("sent %u\n", sent);
    for (uint8_t uid = 1; uid <= ROBOTS; uid++) printf("%u %u\n", uid, heard[uid]);
}

int main(void) {
    kilo_init();
    kilo_message_tx = on_transmit;
    kilo_message_tx_success = on_sent;
    kilo_message_rx = on_message;
    kilo_start(setup, loop);
    return 0;
}
