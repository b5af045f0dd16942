/// delay() up to the begin of a tick, as `kilotwin port` tries a program that waits: then interrupts
/// do not prolong it on the robot, and no message comes at its end.
#include <kilolib.h>

void kilotwin_delay(uint16_t ms) {
    const uint32_t begin = kilo_ticks;
    const uint32_t ticks = (ms * 1000UL + 32767) >> 15;  // of 32.768 ms
    while (kilo_ticks - begin < ticks) {
    }
}
