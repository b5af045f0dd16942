/// Answer of a robot's runtime to a question for its vitals (boot_loaders.md 5.1), in every state
/// in which it hears. The program takes no part in it, and notices no more than a busy channel.
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

#ifdef __cplusplus
extern "C" {
#endif

#define ROBOT_ANSWER_ATTEMPTS 4

/// An answer that is to be given; all zeros: none.
typedef struct {
    uint8_t matches;   ///< that pass before the next attempt
    uint8_t attempts;  ///< that are left
} robot_answer_t;

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

/// Makes the answer, CRC included. `state` is a robot_state_t, `voltage` as get_voltage() gives it:
/// -1 where it is not known.
void robot_answer_fill(message_t *answer, uint16_t uid, uint8_t state, int16_t voltage);

#ifdef __cplusplus
}
#endif

#endif
