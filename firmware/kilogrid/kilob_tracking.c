#include "kilob_tracking.h"

#include <string.h>

// In ticks of 32 ms, so 62 of them: 2.03 s (hardware.md 3.8).
#define PERIOD_MS 2000

static uint32_t report_after;

void kilob_tracking_init(void) {
    report_after = 0;
    kilob_messaging_init();
}

void kilob_tracking(tracking_user_data_t *data) {
    const uint32_t now = kilo_ticks;
    if (now <= report_after) return;
    // Before the queue is tried: a report that finds it full is left out, and the next one is due a
    // whole period later.
    report_after = now + MS_TO_TICKS(PERIOD_MS);
    IR_message_t *message = kilob_message_send();
    if (message == NULL) return;
    message->type = TRACKING_MSG_TYPE;
    memcpy(message->data, data->byte, sizeof data->byte);
}
