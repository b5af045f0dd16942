/// A queue of messages to send. Each is tried again until it goes out.
#ifndef KILOB_MESSAGING_H
#define KILOB_MESSAGING_H

#include <stddef.h>

#include "kilolib.h"
#include "message.h"
#include "ringbuffer.h"

/// Empties the queue; takes over kilo_message_tx and kilo_message_tx_success.
void kilob_messaging_init(void);

/// A place at the end of the queue, to be filled with data and type at once: it may go out at any
/// tick from now on. The checksum is added when it is sent. NULL if three messages wait.
IR_message_t *kilob_message_send(void);

#endif
