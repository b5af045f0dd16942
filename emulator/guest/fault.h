/// What goes wrong in a guest, in words.
#ifndef KILOTWIN_GUEST_FAULT_H
#define KILOTWIN_GUEST_FAULT_H

#include <string>

#include "base/events.h"
#include "guest/program.h"
#include "guest/stack.h"

namespace kilotwin {

struct FaultReport {
    EventKind kind;
    std::string text;
};

/// Of a fault of `program`, after GuestStack::Outcome::FAULT.
FaultReport explain(const GuestStack::Fault &fault, const Program &program);

/// Mistakes that a program goes on after, as bits.
enum Mistakes : uint8_t {
    DIVIDES_BY_ZERO = 1,
    LOST_POINTER = 2,
    BEYOND_VARIABLES = 4,
    JUMPS_TO_ZERO = 8,
};

struct MistakeReport {
    uint8_t mistake;  ///< of Mistakes; 0: none of them, `program` has to stop
    std::string text;
};

/// Of what the handler of a fault met.
MistakeReport explain(GuestStack::Mistake mistake, const void *address, const Program &program);

}  // namespace kilotwin

#endif
