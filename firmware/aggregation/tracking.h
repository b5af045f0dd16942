/// When the robot reports to the grid.
///
/// Decides, never acts. Reports come each TRACKING_TICKS; the first one after a part of that which
/// depends on the uid, so that robots started at once do not all speak at once.
#ifndef AGGREGATION_TRACKING_H
#define AGGREGATION_TRACKING_H

#include <stdbool.h>
#include <stdint.h>

#include "params.h"

/// The caller owns it. `number` is for reading: that of the last report, from 1.
typedef struct {
    uint32_t next;
    uint16_t number;
} tracking_t;

void tracking_init(tracking_t *tracking, const params_t *params, uint32_t now, uint16_t uid);

/// Whether a report is due at `now`; then it counts as made. After a pause one is due, not all that
/// were missed. Never if TRACKING_TICKS is 0.
bool tracking_due(tracking_t *tracking, const params_t *params, uint32_t now);

#endif
