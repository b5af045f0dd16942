/// Receives messages by infrared light into a queue, by interrupts, also while flash is written.
#ifndef BOOTLOADER_AVR_RECEIVER_H
#define BOOTLOADER_AVR_RECEIVER_H

#include <stdbool.h>

#include "message.h"

/// Switches the comparator on, and timer 1, which times its edges. Both are as after a reset.
void receiver_init(void);

/// The oldest message, as it came; NULL if there is none. A frame takes 4.4 ms on air, and the
/// queue has room for 15: what comes while it is full is lost.
const message_t *receiver_oldest(void);

/// Takes the oldest message out of the queue. The pointer to it is not valid any more.
void receiver_drop_oldest(void);

/// A frame is coming in.
bool receiver_in_frame(void);

#endif
