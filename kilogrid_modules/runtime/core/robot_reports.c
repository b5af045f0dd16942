#include "robot_reports.h"

#include <string.h>

#include "../../../firmware/kilolib/core/robot_query.h"
#include "kilogrid_can.h"

// Layout of the frame: type and cell share the first byte, as in tracking.
enum { FRAME_TYPE = 0, FRAME_UID = 1, FRAME_ANSWER = 3, FRAME_STATE = 7 };
#define CELL_SHIFT 6
#define UID_BYTES 2
#define ANSWER_BYTES 4

bool robot_reports_add(robot_reports_t *reports, const message_t *message, uint8_t cell) {
    const uint8_t *data = message->data;
    if (message->type != BOOTPGM_REPORT) return false;
    if (reports->used == ROBOT_REPORTS) return true;
    uint8_t *frame = reports->frames[(uint8_t)(reports->first + reports->used) % ROBOT_REPORTS];
    frame[FRAME_TYPE] =
        (uint8_t)(KILOGRID_CAN_TO_HOST_TYPE_ROBOT_REPORT_CHOICE | (unsigned)cell << CELL_SHIFT);
    memcpy(frame + FRAME_UID, data + REPORT_UID, UID_BYTES);
    memcpy(frame + FRAME_ANSWER, data + REPORT_BYTES, ANSWER_BYTES);
    frame[FRAME_STATE] = data[REPORT_STATE];
    reports->used = (uint8_t)(reports->used + 1);
    return true;
}

bool robot_reports_take(robot_reports_t *reports, uint8_t frame[ROBOT_REPORT_BYTES]) {
    if (reports->used == 0) return false;
    memcpy(frame, reports->frames[reports->first], ROBOT_REPORT_BYTES);
    reports->first = (uint8_t)((reports->first + 1) % ROBOT_REPORTS);
    reports->used = (uint8_t)(reports->used - 1);
    return true;
}
