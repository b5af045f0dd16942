// Borders of the robot's memory, by the names of avr-libc's linker script and heap. Programs that
// measure their free RAM use them; the values mean nothing here. Linked only into those programs.
// Weak: a program may define some of them.
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

/// End of the heap in use; 0: none.
extern void *__brkval;
__attribute__((weak)) void *__brkval;
/// List of freed blocks.
extern void *__flp;
__attribute__((weak)) void *__flp;

// NOLINTEND(bugprone-reserved-identifier)
