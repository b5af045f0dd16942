#include "utils.h"

#include <avr/io.h>
#include <stdbool.h>

// A motor at rest starts only at full duty (hardware.md 3.8).
#define PUSH 255
#define PUSH_MS 20

// The pins that drive the motors: outputs while the motors may run.
#define LEFT_MOTOR_PIN (1 << 3)   // of port B
#define RIGHT_MOTOR_PIN (1 << 3)  // of port D

static direction_t direction = UNDEFINED;
static bool motors_enabled;

static void ignore(IR_message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
}

message_rx_t utils_message_rx = ignore;

// Only RUN switches the motors' pins on, and the host may move a robot that never got it.
static void enable_motors(void) {
    if (motors_enabled) return;
    motors_enabled = true;
    DDRB |= LEFT_MOTOR_PIN;
    DDRD |= RIGHT_MOTOR_PIN;
}

static void obey_or_pass_on(IR_message_t *message, distance_measurement_t *distance) {
    switch (message->type) {
    case GO_STRAIGHT:
        enable_motors();
        move_straight();
        break;
    case TURN_LEFT:
        enable_motors();
        turn_left();
        break;
    case TURN_RIGHT:
        enable_motors();
        turn_right();
        break;
    default: utils_message_rx(message, distance);
    }
}

void utils_init(void) { kilo_message_rx = obey_or_pass_on; }

static uint8_t capped(uint8_t value, uint8_t most) { return value < most ? value : most; }

void safe_set_motors(uint8_t left, uint8_t right) {
    set_motors(capped(left, MOTOR_LEFT_MAX), capped(right, MOTOR_RIGHT_MAX));
}

// Both motors are pushed, also where one is to stand afterwards, and delay() blocks loop() for it.
static void go(direction_t wanted, uint8_t left, uint8_t right) {
    if (direction == wanted) return;
    direction = wanted;
    set_motors(PUSH, PUSH);
    delay(PUSH_MS);
    safe_set_motors(left, right);
}

void turn_left(void) { go(LEFT, kilo_turn_left, 0); }
void turn_right(void) { go(RIGHT, 0, kilo_turn_right); }
void move_straight(void) { go(STRAIGHT, kilo_straight_left, kilo_straight_right); }

void stop(void) {
    direction = UNDEFINED;
    safe_set_motors(0, 0);
}

void init_motors(void) { stop(); }

direction_t get_direction(void) { return direction; }
