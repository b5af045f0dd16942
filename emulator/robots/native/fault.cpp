#include "robots/native/fault.h"

#include "base/confinement.h"

#include <cstdio>
#include <cstring>
#include <utility>

namespace kilotwin {

FaultReport explain(const GuestStack::Fault &fault, const Program &program) {
    CodePath code = fault.place.path();
    if (fault.stuck)
        return {EventKind::ENDLESS,
                "it computed for " + std::to_string(GuestStack::STUCK_CPU_S) +
                    " s of CPU time, or slept for " + std::to_string(GuestStack::STUCK_WALL_S) +
                    " s, while its clock stood still",
                std::move(code)};
    if (fault.system_call >= 0)
        return {EventKind::CRASH,
                "it made a system call that is not allowed here, " +
                    system_call_name(fault.system_call),
                std::move(code)};
    if (fault.stack_overflow)
        return {EventKind::STACK_OVERFLOW,
                "its stack grew over " + std::to_string(GuestStack::BYTES) + " bytes",
                std::move(code)};
    // Accesses that could be redirected did not come here: this one could not.
    if (program.guards(fault.address))
        return {EventKind::CRASH, "it wrote or read beyond its own variables", std::move(code)};
    char text[96];
    std::snprintf(text, sizeof text, "%s at address %p", strsignal(fault.signal), fault.address);
    return {EventKind::CRASH, text, std::move(code)};
}

MistakeReport explain(GuestStack::Mistake mistake, const void *address, const Program &program) {
    if (mistake == GuestStack::Mistake::DIVISION_BY_ZERO)
        return {DIVIDES_BY_ZERO,
                "it divides by zero; as on the robot, it goes on with a wrong number"};
    // The robot has memory at these addresses, as a number.
    if (LostMemory::is_the_robots(address)) {
        char text[128];
        std::snprintf(text, sizeof text,
                      "it uses a pointer that is NULL or wild, at address 0x%03x; there it reads "
                      "zeros, and what it writes is lost",
                      static_cast<unsigned>(reinterpret_cast<uintptr_t>(address)));
        return {LOST_POINTER, text};
    }
    if (program.is_beside_state(address))
        return {BEYOND_VARIABLES, "it goes beyond its own variables; there it reads zeros, and "
                                  "what it writes is lost"};
    return {0, {}};
}

}  // namespace kilotwin
