/// Sending a frame by infrared light.
#ifndef KILOLIB_AVR_INFRARED_SEND_H
#define KILOLIB_AVR_INFRARED_SEND_H

#include <stdbool.h>

#include "message.h"

/// Makes the pins of the infrared LED outputs.
void kilolib_infrared_send_init(void);

/// Sends the message as it is, crc included, in 4.37 ms. False if the comparator saw light in
/// the leader, after which nothing more is sent. Interrupts have to be off.
bool kilolib_infrared_send(const message_t *message);

#endif
