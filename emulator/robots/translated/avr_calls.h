/// Calls on the stack of an ATmega328P, for reports of where a program was.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_AVR_CALLS_H
#define KILOTWIN_ROBOTS_TRANSLATED_AVR_CALLS_H

#include <cstdint>

#include "base/events.h"

namespace kilotwin {

/// Where the program is that is at the byte address `pc`, with its data space (registers first) and
/// its flash of atmega328p::FLASH_BYTES. The bytes above the stack pointer are searched for
/// addresses behind a call.
CodePath avr_code_path(uint32_t pc, const uint8_t *data, const uint8_t *flash);

}  // namespace kilotwin

#endif
