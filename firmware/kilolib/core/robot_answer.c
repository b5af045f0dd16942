#include "robot_answer.h"

#include <string.h>

#include "message_crc.h"
#include "robot_query.h"

// Questions for pages are the boot loader's. A question that cells repeat, or several modules ask,
// is answered once if the slot comes after the last of them.
void robot_answer_take(robot_answer_t *answer, const uint8_t *query, uint16_t uid) {
    if (query[QUERY_FIRST] != ROBOT_QUERY_VITALS || !robot_query_is_for(query, uid)) return;
    answer->matches = robot_query_slot(uid, query[QUERY_NONCE], query[QUERY_SLOTS]);
    answer->attempts = ROBOT_ANSWER_ATTEMPTS;
}

// Low byte first, as all words of messages are.
static void put_word(uint8_t *place, uint16_t word) {
    place[0] = (uint8_t)word;
    place[1] = (uint8_t)(word >> 8);
}

// A voltage of -1 becomes 0xFFFF, which no reading is. Bytes that this answer does not need are 0.
void robot_answer_fill(message_t *answer, uint16_t uid, uint8_t state, int16_t voltage) {
    uint8_t *data = answer->data;
    memset(answer, 0, sizeof *answer);
    put_word(data + REPORT_UID, uid);
    data[REPORT_FIRST] = ROBOT_QUERY_VITALS;
    put_word(data + REPORT_BYTES, (uint16_t)voltage);
    data[REPORT_STATE] = (uint8_t)(ROBOT_REPORT_IN_PROGRAM + state);
    answer->type = BOOTPGM_REPORT;
    answer->crc = message_crc(answer);
}
