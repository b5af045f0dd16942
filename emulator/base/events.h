/// Events of robots for people to read: prints, notes, failures. Each is a row of a run's events.
#ifndef KILOTWIN_BASE_EVENTS_H
#define KILOTWIN_BASE_EVENTS_H

#include <string>
#include <vector>

#include "base/clock.h"

namespace kilotwin {

/// NOTE marks what a program's author cannot want, or what the emulator does not do; BUSY_WAIT a
/// wait that costs much, UNDEFINED what the C standard leaves undefined, of a program that was
/// built to look. FAULT is a failure of the robot that the experiment asked for. After these and
/// PRINT the program goes on, unless the robot is dead; the others park it.
enum class EventKind { PRINT, NOTE, BUSY_WAIT, ENDLESS, CRASH, STACK_OVERFLOW, UNDEFINED, FAULT };

/// The kind's name in the run folder.
inline const char *name_of(EventKind kind) {
    static const char *const NAMES[] = {"print", "note",           "busy_wait",           "endless",
                                        "crash", "stack_overflow", "undefined_behaviour", "fault"};
    return NAMES[static_cast<int>(kind)];
}

/// Where a program was: addresses in its file (in the shared object of a native one, in flash in
/// bytes of one that runs by its machine code), of an instruction and of the calls that led there,
/// innermost first; 0 for one outside of the file. Calls are found by return addresses on the
/// stack; so calls that are over may be among them, and each of them counts only if it calls the
/// function of the one before. Empty: not known.
using CodePath = std::vector<uint32_t>;

/// One event. Robots run ahead of one another, so that events come out of order; the simulation
/// sorts them by time before it hands them out.
struct Event {
    Cycles at;            ///< the robot's own time
    uint32_t robot;       ///< index; of a module its number in the grid
    uint32_t tick;        ///< the robot's kilo_ticks
    std::string program;  ///< name of the robot's program
    EventKind kind;       ///< decides whether the robot goes on
    std::string text;     ///< what it printed, or a sentence for people
    CodePath code = {};   ///< where that came about; of a print empty
};

/// In the order in which robots were run.
using Events = std::vector<Event>;

}  // namespace kilotwin

#endif
