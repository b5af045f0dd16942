// Asked for a message it mostly has none. What it sends, when, and how it drives depends on all
// that it hears, when, and on how often it was asked; callbacks change its motors and its LED, too.
// 0x40 sets bits of `habits`.
#define DEBUG
#include <avr/eeprom.h>
#include <debug.h>
#include <kilolib.h>
#include <stddef.h>
#include <stdlib.h>

enum {
    PRINTS = 1,
    WAITS = 2,
    CRASHES = 4,
    LOOKS = 8,
    SAVES = 16,
    CALLS_BACK_LATE = 32,
    CHATS = 64,
    ROUNDS = 128
};

static message_t out;
static uint8_t habits, heard, sent;
static uint16_t asked, sum;
static uint32_t next_leg, news_at;

static void mix(uint16_t with) { sum = (uint16_t)(sum * 31 + with + (uint16_t)kilo_ticks); }

static void plan(void) {
    const uint16_t span = habits & CHATS ? 12 : 240;
    news_at = kilo_ticks + 3 + rand_soft() % span + sum % 7;
}

static void on_message(message_t *message, distance_measurement_t *distance) {
    if (message->type == 0x40) {
        habits |= message->data[0];
        return;
    }
    heard++;
    mix((uint16_t)(message->data[0] + distance->high_gain));
    set_color(sum & 0x3F);
    if (sum % 3 == 0) set_motors(kilo_turn_left, sum % 2 ? kilo_turn_right : 0);
    if (sum % 8 == 1) news_at = kilo_ticks + sum % 5;
    if (habits & CALLS_BACK_LATE) delay(sum % 64);
}

// Sets how floats are rounded, which is no variable of the program.
static void round_otherwise(void) {
    const uint32_t mode = 0x1F80 | (uint32_t)(sum & 3) << 13;
    if (sum % 8 == 3) __asm__ volatile("ldmxcsr %0" ::"m"(mode));
    volatile float third = 1;
    third = third / 3 + 1e-8f;
    union {
        float number;
        uint16_t low;
    } bits = {third};
    mix(bits.low);
}

static message_t *send(void) {
    asked++;
    if (asked % 64 == 0) set_motors(kilo_straight_left, 0);
    if (kilo_ticks < news_at) return NULL;
    out.type = 5;
    out.data[0] = (uint8_t)(kilo_uid + heard);
    out.data[1] = (uint8_t)asked;
    out.crc = message_crc(&out);
    return &out;
}

static void on_success(void) {
    sent++;
    set_motors(0, kilo_straight_right);
    plan();
}

static void setup(void) {
    rand_seed(rand_hard());
    sum = rand_hard();
    plan();
}

static void loop(void) {
    if (habits & LOOKS) mix((uint16_t)get_ambientlight() + (uint16_t)get_voltage());
    if (kilo_ticks < next_leg) return;
    next_leg = kilo_ticks + 5 + rand_soft() / 4;
    mix(rand_hard());
    if (habits & ROUNDS) round_otherwise();
    if (sum % 4 == 0) {
        set_motors(0, 0);
    } else {
        spinup_motors();
        set_motors(kilo_straight_left, (uint8_t)(kilo_straight_right - sum % 20));
    }
    if (habits & WAITS) delay(sum % 512);
    if (habits & SAVES && sum % 4 == 1) eeprom_write_byte((uint8_t *)0x40, (uint8_t)sum);
    if (habits & SAVES) mix(eeprom_read_byte((const uint8_t *)0x40));
    if (habits & PRINTS && sum % 8 == 0) printf("%u heard, %u sent, %u asked", heard, sent, asked);
    if (habits & CRASHES && sum % 64 == 5) abort();
}

int main(void) {
    kilo_message_rx = on_message;
    kilo_message_tx = send;
    kilo_message_tx_success = on_success;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
