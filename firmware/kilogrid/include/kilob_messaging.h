/// A queue of messages to send: three places, first come first served. Each message is tried again
/// until it goes out, one frame per kilo_tx_period. Call all of it from the main program only; the
/// queue is emptied in an interrupt.
#ifndef KILOB_MESSAGING_H
#define KILOB_MESSAGING_H

#include <stddef.h>

#include "kilolib.h"
#include "message.h"
#include "ringbuffer.h"

/// Empties the queue; takes over kilo_message_tx and kilo_message_tx_success. Call it before
/// kilo_start().
void kilob_messaging_init(void);

/// A place at the end of the queue, to be filled with data and type at once: it may go out at any
/// tick from now on. The checksum is added when it is sent. NULL if three messages wait.
IR_message_t *kilob_message_send(void);

#endif
