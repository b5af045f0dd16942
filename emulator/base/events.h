/// What happened to a robot that people want to know of: prints, warnings, failures.
#ifndef KILOTWIN_BASE_EVENTS_H
#define KILOTWIN_BASE_EVENTS_H

#include <string>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// NOTE: the robot goes on, but its program does what its author cannot want, or what does not
/// happen here.
enum class EventKind { PRINT, NOTE, BUSY_WAIT, ENDLESS, CRASH, STACK_OVERFLOW };

/// As written to the run folder.
inline const char *name_of(EventKind kind) {
    static const char *const NAMES[] = {"print",   "note",  "busy_wait",
                                        "endless", "crash", "stack_overflow"};
    return NAMES[static_cast<int>(kind)];
}

struct Event {
    Cycles at;       ///< the robot's own time
    uint32_t robot;  ///< index
    uint32_t tick;   ///< the robot's kilo_ticks
    std::string program;
    EventKind kind;
    std::string text;
};

using Events = std::vector<Event>;

}  // namespace kilotwin

#endif
