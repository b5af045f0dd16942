/// Talks and listens: each robot sends its number, about twice a second, and hears the others.
///
/// LED: blue for a moment after each message of its own; else green if another robot was heard
/// within the last two seconds, red if not.
#include <kilolib.h>
#include <stdbool.h>

#define TYPE_HELLO 2  // 0x02 to 0x7F are free for programs
#define HEARD_TICKS (2 * TICKS_PER_SEC)
#define FLASH_TICKS 3

static message_t hello;

// Callbacks interrupt loop() anywhere. What they share with it is volatile, and one byte: an
// interrupt may come between the bytes of anything longer.
static volatile bool heard;
static volatile bool sent;

static bool heard_any, sent_any;
static uint32_t heard_at, sent_at;

// A message has arrived whole: its checksum is right. Be short here, for meanwhile the robot hears
// nothing else and its clock stands.
static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    if (message->type == TYPE_HELLO) heard = true;
}

// The robot may send now. NULL would keep it silent until the next tick.
static message_t *on_transmit(void) { return &hello; }

static void on_sent(void) { sent = true; }

static uint32_t ticks_now(void) {
    uint32_t now = kilo_ticks;
    while (now != kilo_ticks) now = kilo_ticks;
    return now;
}

static void setup(void) {}

static void loop(void) {
    // The clock after the flag: read before, it would tell a time at which that had not happened
    // yet.
    if (heard) {
        heard = false;
        heard_any = true;
        heard_at = ticks_now();
    }
    if (sent) {
        sent = false;
        sent_any = true;
        sent_at = ticks_now();
    }

    const uint32_t now = ticks_now();
    if (sent_any && now - sent_at < FLASH_TICKS) {
        set_color(RGB(0, 0, 3));
    } else if (heard_any && now - heard_at < HEARD_TICKS) {
        set_color(RGB(0, 3, 0));
    } else {
        set_color(RGB(3, 0, 0));
    }
}

// kilo_init() reads the number and switches the interrupts on. The callbacks are in place before,
// so that no interrupt finds one half written; the message is ready before kilo_start().
int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = on_transmit;
    kilo_message_tx_success = on_sent;
    kilo_init();

    hello.type = TYPE_HELLO;
    hello.data[0] = (uint8_t)kilo_uid;
    hello.data[1] = (uint8_t)(kilo_uid >> 8);
    hello.crc = message_crc(&hello);  // always last; without it robots ignore the message

    kilo_start(setup, loop);
    return 0;
}
