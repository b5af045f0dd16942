/// assert() that stops the robot, not the emulator.
#include "kt_avr.h"

#undef assert

#ifdef NDEBUG
#define assert(condition) ((void)0)
#else
#define assert(condition) ((condition) ? (void)0 : kt_unusable("assert failed: " #condition))
#endif
