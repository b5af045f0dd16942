/// Messages of an overhead controller to robot programs. Only controllers with a camera send any;
/// they arrive at kilo_message_rx like those of robots.
#ifndef __OHC_H__
#define __OHC_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

/// `data` of a message of type GPS: where robot `id` is, as a camera above sees it.
typedef struct {
    uint16_t id;      ///< of the robot, kilo_uid
    int16_t x;        ///< units are those of the camera's host
    int16_t y;        ///< likewise
    int8_t theta;     ///< heading
    uint16_t unused;  ///< not sent: a controller fills the first eight bytes (hardware.md 1.4)
} gpsmsg_t;

#endif
