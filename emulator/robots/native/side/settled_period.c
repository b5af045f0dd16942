// Linked only into programs that cannot change kilo_tx_period after their set-up (build/period.py).
#include "side.h"

const uint8_t kt_settled_period = 1;
