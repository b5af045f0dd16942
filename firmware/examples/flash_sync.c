/// Flashes in step: each robot starts with a clock of its own, and soon all flash together.
///
/// Robots tell each other their clocks. One that hears of a clock ahead of its own sets it forward,
/// so that all of them follow the one most ahead, over any number of hops.
///
/// LED: white for an eighth of a second every two seconds, else off.
#include <kilolib.h>
#include <stdbool.h>
#include <stddef.h>

#define TYPE_CLOCK 2
#define PERIOD_TICKS 64
#define FLASH_TICKS 4

static message_t message;

// The robot's clock is kilo_ticks + ahead. Only callbacks change `ahead` once `started` is set, and
// callbacks do not interrupt one another.
static volatile uint32_t ahead;
static volatile bool started;

static uint32_t get_clock(const uint8_t *bytes) {
    return bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

static void put_clock(uint8_t *bytes, uint32_t clock) {
    for (uint8_t i = 0; i < 4; i++) bytes[i] = (uint8_t)(clock >> (8 * i));
}

// The difference of two clocks is right even if one has wrapped. The robot stays one tick behind:
// ticks come at a different moment on each robot, and two that wanted to be level would overtake
// each other by a part of a tick again and again.
static void on_message(message_t *received, distance_measurement_t *distance) {
    (void)distance;
    if (received->type != TYPE_CLOCK || !started) return;
    const uint32_t mine = kilo_ticks + ahead;
    const int32_t difference = (int32_t)(get_clock(received->data) - mine);
    if (difference > 1) ahead += (uint32_t)difference - 1;
}

// Made here, at the last moment, the message tells the time at which it is sent.
static message_t *on_transmit(void) {
    if (!started) return NULL;
    message.type = TYPE_CLOCK;
    put_clock(message.data, kilo_ticks + ahead);
    message.crc = message_crc(&message);
    return &message;
}

// Interrupts change both parts, four bytes each: read until two readings agree.
static uint32_t clock_now(void) {
    uint32_t now, again = kilo_ticks + ahead;
    do {
        now = again;
        again = kilo_ticks + ahead;
    } while (now != again);
    return now;
}

static void setup(void) {
    ahead = rand_hard();
    started = true;
}

static void loop(void) {
    const bool flash = clock_now() % PERIOD_TICKS < FLASH_TICKS;
    set_color(flash ? RGB(3, 3, 3) : RGB(0, 0, 0));
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = on_transmit;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
