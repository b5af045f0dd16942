// Linked only into programs that name kilo_tx_period. Of all others the engine knows when
// kilo_message_tx is called next.
#include "kilolib.h"

volatile uint16_t kilo_tx_period;
