/// Receiving frames by infrared light, and what becomes of them.
#ifndef KILOLIB_AVR_INFRARED_RECEIVE_H
#define KILOLIB_AVR_INFRARED_RECEIVE_H

#include <stdbool.h>

/// Switches the comparator on, and timer 1, which times its edges. Needs the converter.
void kilolib_infrared_receive_init(void);

/// Switches the comparator off.
void kilolib_infrared_receive_stop(void);

/// A frame is coming in.
bool kilolib_infrared_in_frame(void);

/// A frame is coming in, or its first edge is there and waits for its interrupt.
bool kilolib_infrared_receiving(void);

/// The start of a frame is coming in, from which its strength is measured.
bool kilolib_infrared_measuring(void);

/// A frame has begun since the last call.
bool kilolib_infrared_frame_began(void);

/// Drops an edge that waits for its interrupt: it is the robot's own light. Interrupts have to be
/// off, and no frame coming in.
void kilolib_infrared_forget_edge(void);

#endif
