// Drives and rests by turns, and keeps an account of what its light sensor reads; talks meanwhile.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static message_t out;
static uint32_t next_tick;
static uint16_t sum;

static message_t *send(void) { return &out; }

static void setup(void) {
    rand_seed(rand_hard());
    out.data[0] = (uint8_t)kilo_uid;
    out.crc = message_crc(&out);
}

static void loop(void) {
    sum = (uint16_t)(sum * 31 + get_ambientlight());
    if (kilo_ticks < next_tick) return;
    if (rand_soft() & 1) {
        set_motors(0, 0);
    } else {
        spinup_motors();
        set_motors(kilo_straight_left, kilo_straight_right);
    }
    next_tick = kilo_ticks + rand_soft() % 32;
    printf("sum %u", sum);
}

int main(void) {
    kilo_message_tx = send;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
