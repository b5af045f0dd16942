/// Faults and mistakes of guests, as texts for the run folder.
///
/// A fault ends a program. A mistake is what an AVR does not stop at either (fixups.h): the program
/// goes on, and the first of each kind is reported.
#ifndef KILOTWIN_ROBOTS_NATIVE_FAULT_H
#define KILOTWIN_ROBOTS_NATIVE_FAULT_H

#include <string>

#include "base/events.h"
#include "robots/native/program.h"
#include "robots/native/stack.h"
#include "robots/record.h"

namespace kilotwin {

/// A fault: the kind of its event, the reason, a clause that begins with "it", and where.
struct FaultReport {
    EventKind kind;
    std::string text;
    CodePath code;
};

/// Describes a fault of `program`, after GuestStack::Outcome::FAULT.
FaultReport explain(const GuestStack::Fault &fault, const Program &program);

struct MistakeReport {
    uint8_t mistake;  ///< one of Mistakes; 0: none of them, the program has to stop
    std::string text;
};

/// Classifies and describes a mistake that the signal handler met at `address` (of the memory, not
/// of the code). Called in the handler: allocates, but touches no state of the engine.
MistakeReport explain(GuestStack::Mistake mistake, const void *address, const Program &program);

}  // namespace kilotwin

#endif
