/// The messages that are commands to the robot itself (hardware.md 1.4).
#ifndef KILOLIB_AVR_COMMANDS_H
#define KILOLIB_AVR_COMMANDS_H

#include "message.h"

/// Obeys a message of type 0x80 and up; unknown ones change nothing. Called with interrupts off.
/// Does not return from BOOT and RESET.
void kilolib_command_obey(message_t *message);

#endif
