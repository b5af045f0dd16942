/// Sends frames of infrared light, pulse by pulse, for robots and the Kilogrid's modules.
#ifndef KILOLIB_AVR_FRAME_SENDER_H
#define KILOLIB_AVR_FRAME_SENDER_H

#include <stdbool.h>
#include <stdint.h>

#include "message.h"

/// Sends the message as it is, crc included, in 4.37 ms, by the LED at `pins` of port B. False if
/// the comparator saw light in the leader, after which nothing more is sent. Interrupts have to be
/// off.
bool kilolib_infrared_send_frame(const message_t *message, uint8_t pins);

#endif
