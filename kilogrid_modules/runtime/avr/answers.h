/// What the module says when the host asks.
#ifndef MODULE_AVR_ANSWERS_H
#define MODULE_AVR_ANSWERS_H

/// Sends what has been asked for: tracking records, health.
void runtime_answer_host(void);

/// Sends what the program wants sent to all modules.
void runtime_send_broadcast(void);

#endif
