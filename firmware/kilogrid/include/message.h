/// The infrared message as Kilogrid programs name it: the Kilobot's own, and the types that the
/// grid adds. 0x00 to 0x3F are for robots, 0x40 to 0x7F for modules, the rest are kilolib's.
#ifndef KILOGRID_MESSAGE_H
#define KILOGRID_MESSAGE_H

#include "../../kilolib/include/message.h"

/// Names of the grid's programs for message_t and its types; the layout is the same.
typedef message_t IR_message_t;
typedef message_type_t IR_message_type_t;

enum {
    TEST = 0x0A,
    TRACKING = 0x10,     ///< robot to module: seven bytes for the host
    GO_STRAIGHT = 0x7D,  ///< the host moves robots about, see utils.h
    TURN_LEFT = 0x7E,
    TURN_RIGHT = 0x7F,
};

#endif
