/// printf for robot programs, there only if the program defines DEBUG before including this.
///
/// With DEBUG, debug_init() makes printf() work: by the serial line (38,400 baud) on the robot, by
/// the run's event log in the emulator. Without DEBUG both vanish, arguments and all.
///
/// printf() waits until the line has taken the text, 0.26 ms for each character, in the emulator
/// too. With NONBLOCKING, also defined before including this, it does not wait: the text goes
/// through a queue of 127 characters, and what does not fit is lost.
#ifndef __DEBUG_H__
#define __DEBUG_H__  // NOLINT(bugprone-reserved-identifier): programs know it

// In both cases: a later <stdio.h> would otherwise meet the macro where it declares printf.
#include <stdio.h>

#ifdef DEBUG

#ifdef __AVR__
// Programs that include this count on the registers.
#include <avr/interrupt.h>
#include <avr/io.h>
#endif

#ifdef __cplusplus
extern "C" {
#endif

/// To be called once, in main() or setup(), before the first printf().
void debug_init(void);

#ifdef NONBLOCKING
/// As debug_init(), with the queue. Programs call it by the name debug_init().
void debug_init_nonblocking(void);
#define debug_init() debug_init_nonblocking()
#endif

#ifdef __cplusplus
}
#endif

#else

// Nothing at all, as upstream: not even a semicolon is missed after them.
#define debug_init()
#define printf(...)

#endif

// Macros of the ARGoS simulator's debug.h, by which its programs show values: `field` need not be
// declared outside of it. They vanish here, as they do on robots there. Some programs give
// debug_info_create() the type that they have declared.
#define debug_info_create(...)
#define debug_info_destroy(...)
#define debug_info_get(...)
#define debug_info_set(field, ...)

#endif
