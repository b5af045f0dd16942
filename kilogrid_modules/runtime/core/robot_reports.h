/// Robots' answers to questions (boot_loaders.md 5.1) on their way to the host: each infrared
/// REPORT becomes a ROBOT_REPORT on the bus (wire.md), in every state of the module. The program
/// does not get it.
///
/// Answers come in by the receiver's interrupt and go out by the main loop, one a pass or a
/// millisecond. Frames by infrared are 4.4 ms apart at least, so a few places do; an answer that
/// finds none is lost, and the host asks that robot again.
///
/// Pure; all calls with interrupts off.
#ifndef MODULE_CORE_ROBOT_REPORTS_H
#define MODULE_CORE_ROBOT_REPORTS_H

#include <stdbool.h>
#include <stdint.h>

#include "../../../firmware/kilolib/include/message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ROBOT_REPORTS 4       ///< places
#define ROBOT_REPORT_BYTES 8  ///< data bytes of the CAN frame

/// A ring; all zeros: empty.
typedef struct {
    uint8_t first;          ///< place of the oldest
    volatile uint8_t used;  ///< answers that wait
    uint8_t frames[ROBOT_REPORTS][ROBOT_REPORT_BYTES];
} robot_reports_t;

/// Takes a message with a right crc that `cell`, 0..3, has received. False if it is no answer:
/// then it is the program's.
bool robot_reports_add(robot_reports_t *reports, const message_t *message, uint8_t cell);

/// Takes the oldest answer out: the data bytes of its frame to the host. False if there is none.
bool robot_reports_take(robot_reports_t *reports, uint8_t frame[ROBOT_REPORT_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
