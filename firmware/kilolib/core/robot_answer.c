#include "robot_answer.h"

#include <string.h>

#include "gains.h"
#include "message_crc.h"

#define COUNT (3 << VITALS_COUNT_BIT)

// Questions for pages are the boot loader's. A question that cells repeat, or several modules ask,
// is answered once if the slot comes after the last of them.
void robot_answer_take(robot_answer_t *answer, const uint8_t *query, uint16_t uid) {
    const uint8_t first = query[QUERY_FIRST];
    if (first < ROBOT_QUERY_VITALS || first >= ROBOT_QUERY_GAINS + GAIN_ENTRIES) return;
    if (!robot_query_is_for(query, uid)) return;
    answer->first = first;
    answer->matches = robot_query_slot(uid, query[QUERY_NONCE], query[QUERY_SLOTS]);
    answer->attempts = ROBOT_ANSWER_ATTEMPTS;
}

// Low byte first, as all words of messages are.
static void put_word(uint8_t *place, uint16_t word) {
    place[0] = (uint8_t)word;
    place[1] = (uint8_t)(word >> 8);
}

// The upper bits of a gain, 0 to 3.
static uint8_t upper(int16_t gain) { return (uint8_t)((uint16_t)gain >> 8); }

void robot_answer_hear(robot_heard_t *heard, const message_t *message,
                       const distance_measurement_t *measured) {
    uint8_t *told = heard->told;
    if (!robot_answer_is_heard(message)) return;
    told[0] = (uint8_t)measured->low_gain;
    told[1] = (uint8_t)measured->high_gain;
    const uint8_t count = (uint8_t)(told[2] + (1 << VITALS_COUNT_BIT)) & COUNT;
    told[2] = (uint8_t)(count | upper(measured->high_gain) << VITALS_HIGH_GAIN_BIT |
                        upper(measured->low_gain));
}

// A voltage of -1 has all bits, which no reading has.
void robot_answer_vitals(const robot_heard_t *heard, int16_t voltage, uint8_t *content) {
    content[VITALS_VOLTAGE] = (uint8_t)voltage;
    memcpy(content + VITALS_LOW_GAIN, heard->told, sizeof heard->told);
    content[VITALS_HIGHEST] |= (uint8_t)(upper(voltage) << VITALS_VOLTAGE_BIT);
}

// Bytes behind the state are 0.
void robot_answer_fill(const robot_answer_t *answer, message_t *message, uint16_t uid,
                       uint8_t state, const uint8_t *content) {
    uint8_t *data = message->data;
    put_word(data + REPORT_UID, uid);
    data[REPORT_FIRST] = answer->first;
    memcpy(data + REPORT_BYTES, content, REPORT_CONTENT);
    data[REPORT_STATE] = robot_report_state(answer->first, state);
    data[REPORT_ID_LOW] = 0;
    message->type = BOOTPGM_REPORT;
    message->crc = message_crc(message);
}
