// Only programs that name kilo_tx_period link it: of all others the engine knows when they will
// next be asked for a message.
#include "kilolib.h"

volatile uint16_t kilo_tx_period;
