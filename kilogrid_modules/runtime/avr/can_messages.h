/// CAN frames that the module sends: answers to the host, and what its program sends (CAN.h).
#ifndef MODULE_AVR_CAN_MESSAGES_H
#define MODULE_AVR_CAN_MESSAGES_H

/// Sends robots' answers, and what the host has requested: tracking records, parts of the health
/// report. From the main loop; waits up to 10 ms for the bus at each frame, and gives up at the
/// first that does not get through.
void runtime_answer_host(void);

/// Sends the frame that the program left with CAN_send_broadcast_message(), if any. From the main
/// loop.
void runtime_send_broadcast(void);

#endif
