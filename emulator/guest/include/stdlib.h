/// libc as the AVR has it, where that differs from the PC's: the ranges of the generators.
#ifndef KILOTWIN_GUEST_STDLIB_H
#define KILOTWIN_GUEST_STDLIB_H

#include_next <stdlib.h>

#undef RAND_MAX
#define RAND_MAX 0x7FFF
#define RANDOM_MAX 0x7FFFFFFF

#endif
