/// The system clock of avr-libc, which stands still unless the program moves it. Calendars are left
/// out.
#ifndef KT_TIME_H
#define KT_TIME_H

#include <inttypes.h>
#include <stdlib.h>

#define ONE_HOUR 3600
#define ONE_DAY 86400
#define UNIX_OFFSET 946684800

typedef uint32_t time_t;

/// Seconds since 2000-01-01; 0 at the start.
time_t time(time_t *now);
void set_system_time(time_t now);
/// To be called once a second.
void system_tick(void);
int32_t difftime(time_t end, time_t begin);

#endif
