/// Following gradients that cells send: up or down the values in the bytes of their messages.
///
/// A gradient is a byte of the message, at most four of them. The robot goes straight on while the
/// values go the right way, and turns a large angle when one goes the wrong way, a small one when
/// nothing changed for a while. A value of 0 means that the gradient does not reach there: a robot
/// that receives nothing else for a period has escaped it.
#ifndef KILOB_GRADIENT_H
#define KILOB_GRADIENT_H

#include <stdint.h>

#include "kilolib.h"
#include "message.h"
#include "utils.h"

/// No gradient is followed yet. In seconds: between two looks at the values; mean and standard
/// deviation of small and of large turns; after how long on a gradient the side of turns changes
/// where that is allowed.
void kilob_gradient_tracking_init(double check_period_s, double turn_small_mu_s,
                                  double turn_small_sigma_s, double turn_large_mu_s,
                                  double turn_large_sigma_s, double stuck_timeout_s);

/// Follows the gradient in data[gradient_idx] too. `direction` returns nonzero if a value is the
/// wrong way, kilob_gradient_tracking_decreasing() or _increasing(); `on_escape` is called when the
/// robot left the gradient; with `can_stuck` the side of turns changes now and then. A fifth is
/// ignored.
void kilob_gradient_tracking_config_add(uint8_t gradient_idx,
                                        uint8_t (*direction)(uint8_t, uint8_t),
                                        void (*on_escape)(void), uint8_t can_stuck);

/// Follows none, and looks again after a period.
void kilob_gradient_tracking_reset(void);

/// From loop(): moves the robot.
void kilob_gradient_tracking(void);

/// Nonzero if a gradient is followed that the robot has not escaped.
uint8_t kilob_gradient_has_active(void);

/// Directions: whether `value` is higher (or lower) than all of the period before. A value of 0
/// never is. `gradient` counts in the order of kilob_gradient_tracking_config_add().
uint8_t kilob_gradient_tracking_decreasing(uint8_t gradient, uint8_t value);
uint8_t kilob_gradient_tracking_increasing(uint8_t gradient, uint8_t value);

/// From the receive callback, for each message of a cell. May turn the robot at once.
void kilob_gradient_tracking_message_received(IR_message_t *message,
                                              distance_measurement_t *distance);

#endif
