#include "fake_kilolib.h"

#include <stddef.h>

static void ignore_message(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
}

static message_t *send_nothing(void) { return NULL; }
static void do_nothing(void) {}

fake_robot_t fake;
void (*fake_setup)(void);
void (*fake_loop)(void);

message_rx_t kilo_message_rx = ignore_message;
message_tx_t kilo_message_tx = send_nothing;
message_tx_success_t kilo_message_tx_success = do_nothing;
volatile uint32_t kilo_ticks;
volatile uint16_t kilo_tx_period;
uint16_t kilo_uid;
uint8_t kilo_turn_left;
uint8_t kilo_turn_right;
uint8_t kilo_straight_left;
uint8_t kilo_straight_right;

void fake_reset(void) {
    fake = (fake_robot_t){0};
    kilo_message_rx = ignore_message;
    kilo_message_tx = send_nothing;
    kilo_message_tx_success = do_nothing;
}

void kilo_init(void) {
    kilo_ticks = 0;
    kilo_tx_period = 3906;
    kilo_uid = 42;
    kilo_turn_left = 65;
    kilo_turn_right = 66;
    kilo_straight_left = 67;
    kilo_straight_right = 68;
}

void kilo_start(void (*setup)(void), void (*loop)(void)) {
    fake_setup = setup;
    fake_loop = loop;
}

void set_motors(uint8_t left, uint8_t right) {
    fake.left = left;
    fake.right = right;
    fake.set_motors_calls++;
}

void delay(uint16_t ms) { fake.delayed_ms += ms; }

void spinup_motors(void) { fake.spinup_calls++; }

void set_color(uint8_t rgb) {
    fake.colour = rgb;
    fake.set_color_calls++;
}

uint8_t rand_hard(void) { return (uint8_t)(0xA0 + fake.rand_hard_calls++); }

uint16_t message_crc(const message_t *message) {
    const uint8_t *bytes = (const uint8_t *)message;
    uint16_t crc = 0xFFFF;
    for (int i = 0; i < 10; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++) crc = (uint16_t)(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}
