/// Reports to the host through the cells.
#ifndef KILOB_TRACKING_H
#define KILOB_TRACKING_H

#include <stddef.h>
#include <stdint.h>

#include "kilob_common.h"
#include "kilob_messaging.h"
#include "kilogrid.h"
#include "kilolib.h"
#include "utils.h"

/// Also initialises kilob_messaging.
void kilob_tracking_init(void);

/// Queues a TRACKING message with these seven bytes, at most every two seconds. Call it from loop()
/// as often as you like. If the queue is full the report is left out.
void kilob_tracking(tracking_user_data_t *data);

#endif
