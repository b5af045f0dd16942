/// Reports of a robot to the host: messages of type TRACKING, which the cell below takes and the
/// module keeps until the host polls it.
#ifndef KILOB_TRACKING_H
#define KILOB_TRACKING_H

#include <stddef.h>
#include <stdint.h>

#include "kilob_common.h"
#include "kilob_messaging.h"
#include "kilogrid.h"
#include "kilolib.h"
#include "utils.h"

/// Initialises kilob_messaging too. Call it before kilo_start(); the first report is due at once.
void kilob_tracking_init(void);

/// Queues a TRACKING message with these seven bytes, at most every two seconds. Call it from loop()
/// as often as you like. If the queue is full the report is left out.
void kilob_tracking(tracking_user_data_t *data);

#endif
