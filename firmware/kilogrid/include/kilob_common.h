/// Types of messages that the helpers for Kilogrid robot programs send, and modules that follow
/// them.
#ifndef KILOB_COMMON_H
#define KILOB_COMMON_H

typedef enum {
    TRACKING_MSG_TYPE = 0x10,  ///< what kilob_tracking() sends: TRACKING of message.h
    GRADIENT_MSG_TYPE = 0x21,  ///< cell to robot, by custom: how far to go
} kilob_message_type;

#endif
