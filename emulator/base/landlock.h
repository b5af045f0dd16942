/// Landlock: the kernel's means for a process to give up access to files (landlock(7)). Where it
/// has version 6 (Linux 6.12), signals of the process reach none but its own as well.
#ifndef KILOTWIN_BASE_LANDLOCK_H
#define KILOTWIN_BASE_LANDLOCK_H

#include <string>
#include <vector>

namespace kilotwin {

/// Version of the kernel's Landlock, from 1 on; 0: it has none, or none that is switched on, or
/// KILOTWIN_WITHOUT_LANDLOCK is set: so tests see what is left without it.
int landlock_version();

/// Leaves this thread, and those it starts, the files and folders that are named, with all below;
/// paths that do not exist are passed over. What is open stays usable. Needs no_new_privs. The
/// kernel must have Landlock; EngineError if it refuses.
void landlock_restrict(const std::vector<std::string> &readable,
                       const std::vector<std::string> &executable,
                       const std::vector<std::string> &writable);

}  // namespace kilotwin

#endif
