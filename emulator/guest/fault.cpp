#include "guest/fault.h"

#include <cstdio>
#include <cstring>

namespace kilotwin {

FaultReport explain(const GuestStack::Fault &fault, const Program &program) {
    if (fault.stack_overflow)
        return {EventKind::STACK_OVERFLOW,
                "its stack grew over " + std::to_string(GuestStack::BYTES) + " bytes"};
    if (program.guards(fault.address))
        return {EventKind::CRASH, "it wrote or read beyond its own variables"};
    char text[96];
    std::snprintf(text, sizeof text, "%s at address %p", strsignal(fault.signal), fault.address);
    return {EventKind::CRASH, text};
}

}  // namespace kilotwin
