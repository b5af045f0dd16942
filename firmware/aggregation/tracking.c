#include "tracking.h"

#include "ticks.h"

void tracking_init(tracking_t *tracking, const params_t *params, uint32_t now, uint16_t uid) {
    tracking->number = 0;
    tracking->next = now;
    if (params->TRACKING_TICKS > 0) tracking->next += uid % params->TRACKING_TICKS;
}

bool tracking_due(tracking_t *tracking, const params_t *params, uint32_t now) {
    const uint16_t period = params->TRACKING_TICKS;
    if (period == 0 || !ticks_reached(now, tracking->next)) return false;
    tracking->next = now + period - (now - tracking->next) % period;
    tracking->number++;
    return true;
}
