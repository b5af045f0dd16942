// What avr-libc's linker script and heap call the borders of the robot's memory. Programs that
// measure their free RAM name them; what they find here means nothing. Only those link this.
// Weak: a program may have some of them itself.
#include <stdint.h>

// NOLINTBEGIN(bugprone-reserved-identifier): avr-libc's names

#define BORDER(name)     \
    extern uint8_t name; \
    __attribute__((weak)) uint8_t name

BORDER(__data_start);
BORDER(__data_end);
BORDER(__bss_end);
BORDER(__heap_start);
BORDER(__heap_end);
BORDER(__stack);
BORDER(_etext);
BORDER(etext);
BORDER(__data_load_start);
BORDER(__data_load_end);

/// The end of what malloc() has given out; 0: nothing yet.
extern void *__brkval;
__attribute__((weak)) void *__brkval;
/// The list of what was freed.
extern void *__flp;
__attribute__((weak)) void *__flp;

// NOLINTEND(bugprone-reserved-identifier)
