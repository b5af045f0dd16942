/// What a fault in a guest means, in words.
#ifndef KILOTWIN_GUEST_FAULT_H
#define KILOTWIN_GUEST_FAULT_H

#include <string>

#include "engine/events.h"
#include "guest/program.h"
#include "guest/stack.h"

namespace kilotwin {

struct FaultReport {
    EventKind kind;
    std::string text;
};

/// Of a fault of `program`, after GuestStack::Outcome::FAULT.
FaultReport explain(const GuestStack::Fault &fault, const Program &program);

}  // namespace kilotwin

#endif
