// Linked only into programs that name kilo_message_tx. Others never send, which the engine knows.
#include <stddef.h>

#include "kilolib.h"

static message_t *ignore_tx(void) { return NULL; }

message_tx_t kilo_message_tx = ignore_tx;
