/// Answer of a robot's runtime to a question for its vitals or its gain tables (boot_loaders.md
/// 5.1), in every state in which it hears. The program takes no part in it, and notices no more
/// than a busy channel.
///
/// Slots are compare matches of timer 0 from the question on. The match of the slot is the answer's
/// alone: the program is not asked for a message there. An attempt that finds the channel busy is
/// repeated at the next match, ROBOT_ANSWER_ATTEMPTS in all; it does not move the compare value.
///
/// Pure, constant time; called with interrupts off.
#ifndef KILOLIB_CORE_ROBOT_ANSWER_H
#define KILOLIB_CORE_ROBOT_ANSWER_H

#include <stdbool.h>
#include <stdint.h>

#include "message.h"
#include "robot_query.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ROBOT_ANSWER_ATTEMPTS 4

/// An answer that is to be given; all zeros: none.
typedef struct {
    uint8_t matches;   ///< that pass before the next attempt
    uint8_t attempts;  ///< that are left
    uint8_t first;     ///< what was asked for: ROBOT_QUERY_VITALS, or _GAINS and more
} robot_answer_t;

/// How another robot's answer came in; all zeros: none did.
typedef struct {
    uint8_t told[3];  ///< VITALS_LOW_GAIN to VITALS_HIGHEST, without the voltage's bits
} robot_heard_t;

/// Takes the data of a question. One for something else, or for another robot, changes nothing; one
/// more before the answer has gone out takes the place of the first.
void robot_answer_take(robot_answer_t *answer, const uint8_t *query, uint16_t uid);

/// At each compare match: whether it is time for an attempt. If nothing is being received the
/// driver then sends what robot_answer_fill() made.
static inline bool robot_answer_is_due(robot_answer_t *answer) {
    if (answer->attempts == 0) return false;
    if (answer->matches > 0) {
        answer->matches--;
        return false;
    }
    answer->attempts--;
    return true;
}

/// It has gone out, or is not to.
static inline void robot_answer_end(robot_answer_t *answer) { answer->attempts = 0; }

/// Compare matches up to the next attempt, the next one being 1; 0: there is none.
static inline uint16_t robot_answer_matches(const robot_answer_t *answer) {
    return answer->attempts == 0 ? 0 : (uint16_t)(answer->matches + 1);
}

/// Notes how strongly another robot's answer to VITALS came in; other messages change nothing.
void robot_answer_hear(robot_heard_t *heard, const message_t *message,
                       const distance_measurement_t *measured);

/// Whether it is a message that robot_answer_hear() notes.
static inline bool robot_answer_is_heard(const message_t *message) {
    return message->type == BOOTPGM_REPORT && message->data[REPORT_FIRST] == ROBOT_QUERY_VITALS;
}

/// Content of an answer to VITALS (robot_query.h). `voltage` as get_voltage() gives it: -1 where it
/// is not known. For other questions kilolib_calibration_gains() has it.
void robot_answer_vitals(const robot_heard_t *heard, int16_t voltage, uint8_t *content);

/// Makes the message, CRC included. `state` is a robot_state_t.
void robot_answer_fill(const robot_answer_t *answer, message_t *message, uint16_t uid,
                       uint8_t state, const uint8_t *content);

#ifdef __cplusplus
}
#endif

#endif
