// Walks, turns, rests, talks and listens; what it does depends on all it hears and when.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static message_t out;
static volatile uint8_t heard, obstacle, site;
static volatile uint16_t sum;
static uint32_t next_tick;

static void on_message(message_t *message, distance_measurement_t *distance) {
    if (message->type == 1) {
        site = message->data[0];
        obstacle = message->data[1];
        sum = (uint16_t)(sum * 31 + site + 2 * obstacle + kilo_ticks);
        return;
    }
    heard++;
    sum = (uint16_t)(sum * 31 + message->data[0] + distance->high_gain + kilo_ticks);
}

static message_t *send(void) {
    if (sum % 4 == 0) return NULL;
    out.type = 5;
    out.data[0] = (uint8_t)(kilo_uid + heard);
    out.crc = message_crc(&out);
    if (sum % 16 == 1) out.crc ^= 0x100;
    return &out;
}

static void setup(void) {
    rand_seed(rand_hard());
    sum = rand_hard();
    kilo_tx_period = (uint16_t)(rand_soft() * 30);
}

static void turn(void) {
    spinup_motors();
    if (rand_soft() & 1)
        set_motors(kilo_turn_left, 0);
    else
        set_motors(0, kilo_turn_right);
    if (kilo_uid % 3 == 0)
        delay((uint16_t)(rand_soft() * 4));
    else
        for (uint32_t end = kilo_ticks + rand_soft() % 32; kilo_ticks < end;) {
        }
}

static void loop(void) {
    if (kilo_ticks < next_tick && !(obstacle && next_tick - kilo_ticks > 30)) return;
    uint8_t dice = rand_soft() + (uint8_t)sum;
    set_color(sum & 0x3F);
    if (dice < 50) {
        set_motors(0, 0);
        next_tick = kilo_ticks + rand_soft() * 2;
    } else {
        turn();
        set_motors(kilo_straight_left, (uint8_t)(kilo_straight_right - dice % 20));
        next_tick = kilo_ticks + 10 + rand_soft();
    }
    if (dice % 16 == 0) printf("%u heard, sum %u, site %u", heard, sum, site);
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = send;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
