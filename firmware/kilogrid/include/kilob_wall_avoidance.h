/// Getting away from walls, for robots on cells that warn of them.
///
/// The program calls kilob_on_wall_detected() for each message of a wall cell, and
/// kilob_wall_avoidance() from loop() for as long as that returns true. The robot turns to one side
/// or the other by chance until the cell's light gets weaker, then goes straight on; it turns anew
/// if the light gets stronger again, and to the other side after 7.5 s of turning. A wall is
/// forgotten one second after its last message.
#ifndef KILOB_WALL_AVOIDANCE_H
#define KILOB_WALL_AVOIDANCE_H

#include <stdint.h>

#include "kilolib.h"
#include "message.h"

/// Readings whose sum is compared with the sum before.
#define WALL_READINGS_BUFFER_SIZE 4

/// Before kilo_start(). No wall is known.
void kilob_wall_avoidance_init(void);

/// From the receive callback: a wall cell's message came with this distance. Of `distance` only the
/// high gain counts; `message` is not looked at.
void kilob_on_wall_detected(distance_measurement_t *distance, IR_message_t *message);

/// From loop(): moves the robot; 0 if there was no wall for a second, and then the motors are left
/// as they are.
uint8_t kilob_wall_avoidance(void);

/// The next kilob_wall_avoidance() draws a side anew.
void kilob_wall_avoidance_reset(void);

#endif
