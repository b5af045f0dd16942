/// A gradient: each robot finds out how many hops it is away from the robot with uid 1, the seed.
///
/// Robots tell their hops twice a second. A robot is one hop farther than the nearest it hears, and
/// forgets that after ten seconds without a word that confirms it, so that the gradient follows
/// when robots move.
///
/// LED: white for the seed, then red, green, blue, yellow, magenta, cyan for 1 to 6 hops, and again
/// from red on; off as long as the robot does not know.
#include <avr/interrupt.h>
#include <kilolib.h>
#include <stdbool.h>
#include <stddef.h>

#define TYPE_HOPS 2
#define SEED_UID 1
#define UNKNOWN 255
#define PERIOD_MIN 2900  // units of 128 us; with up to 2,040 more, half a second on average
#define FORGET_TICKS (10 * TICKS_PER_SEC)

static const uint8_t COLOURS[] = {
    RGB(3, 0, 0), RGB(0, 3, 0), RGB(0, 0, 3), RGB(3, 3, 0), RGB(3, 0, 3), RGB(0, 3, 3),
};

static message_t message;

// Single bytes, so that neither loop() nor a callback can find half of one.
static volatile uint8_t hops = UNKNOWN;
static volatile bool confirmed;

static uint32_t confirmed_at;

static void on_message(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    if (received->type != TYPE_HOPS || kilo_uid == SEED_UID) return;
    const uint8_t heard = received->data[0];
    if (heard >= UNKNOWN - 1 || heard + 1 > hops) return;
    hops = (uint8_t)(heard + 1);
    confirmed = true;
}

// The message is made where it is sent. Were loop() to make it, a transmission could catch it half
// changed, with a checksum that does not belong to it.
static message_t *on_transmit(void) {
    if (hops == UNKNOWN) return NULL;
    message.type = TYPE_HOPS;
    message.data[0] = hops;
    message.crc = message_crc(&message);
    return &message;
}

// Two robots that do not hear each other may send at the same time, over and over: their clocks are
// nearly the same, and who is between them hears neither. A period drawn anew each time ends that.
static void on_sent(void) { kilo_tx_period = (uint16_t)(PERIOD_MIN + (uint16_t)rand_soft() * 8); }

static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static void show(uint8_t shown) {
    if (shown == UNKNOWN) {
        set_color(RGB(0, 0, 0));
    } else if (shown == 0) {
        set_color(RGB(3, 3, 3));
    } else {
        set_color(COLOURS[(shown - 1u) % sizeof COLOURS]);
    }
}

static void setup(void) {
    rand_seed(rand_hard());
    if (kilo_uid == SEED_UID) hops = 0;
}

static void loop(void) {
    if (confirmed || kilo_uid == SEED_UID) {
        confirmed = false;
        confirmed_at = ticks_now();
    } else if (ticks_now() - confirmed_at > FORGET_TICKS) {
        // What a callback has just learned must not be forgotten.
        cli();
        if (!confirmed) hops = UNKNOWN;
        sei();
    }
    show(hops);
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = on_transmit;
    kilo_message_tx_success = on_sent;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
