/// Saving the battery.
#ifndef KILOLIB_AVR_SLEEP_H
#define KILOLIB_AVR_SLEEP_H

/// Switches everything off for 8 s, then listens for 10 ms, and for 100 ms more if a frame begins
/// in them. A command that comes in then changes the state.
void kilolib_sleep_for_8_s(void);

#endif
