/// What the parts of the guest's thin half need of one another.
#ifndef KILOTWIN_GUEST_SIDE_H
#define KILOTWIN_GUEST_SIDE_H

#include <stdint.h>

/// Hands text to the run folder, with the robot and its tick.
void kt_print(const char *text, uint32_t bytes);

/// Stops the robot: it asked for something that a robot does not have.
void kt_unusable(const char *what);

#endif
