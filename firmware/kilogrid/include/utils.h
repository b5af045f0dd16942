/// Moving about, for Kilogrid robot programs: simple motions, and the host's GO_STRAIGHT, TURN_LEFT
/// and TURN_RIGHT, by which robots are moved without a program of their own running.
#ifndef KILOGRID_UTILS_H
#define KILOGRID_UTILS_H

#include <stdint.h>

#include "kilolib.h"

/// Motor values are capped here, whatever the calibration says.
#define MOTOR_LEFT_MAX 100
#define MOTOR_RIGHT_MAX 100

/// Rounded down: a tick is 32.768 ms.
#define MS_PER_TICK 32
#define TICKS_TO_MS(a) ((a)*MS_PER_TICK)
#define MS_TO_TICKS(a) ((a) / MS_PER_TICK)
#define SEC_TO_TICKS(a) ((a)*32)

typedef enum { UNDEFINED = 0, LEFT, RIGHT, STRAIGHT } direction_t;

/// Gets every message but the host's three. Never NULL; does nothing until the program sets it.
extern message_rx_t utils_message_rx;

/// Takes over kilo_message_rx. Between kilo_init() and kilo_start().
void utils_init(void);

/// Motors off, direction unknown.
void init_motors(void);

/// Nothing happens if the robot moves that way already. Else both motors are pushed at full power
/// for 20 ms, during which the call blocks, and set to the calibrated values.
void turn_left(void);
void turn_right(void);
void move_straight(void);

/// Motors off.
void stop(void);

/// The last of the above.
direction_t get_direction(void);

/// As set_motors(), capped.
void safe_set_motors(uint8_t left, uint8_t right);

#endif
