/// The shared object of a guest: looked at before it is loaded, so that nothing of it runs then.
#ifndef KILOTWIN_ROBOTS_NATIVE_GUEST_FILE_H
#define KILOTWIN_ROBOTS_NATIVE_GUEST_FILE_H

#include <string>

namespace kilotwin {

/// Loads the shared object at `path` for the life of the process; dlopen()'s handle.
///
/// EngineError that begins with `failure` if it cannot be loaded, or has what the loader would run
/// (initialisers, resolvers of ifunc), an executable stack, libraries beside libc and libm, or
/// symbols for others than those that the engine looks for.
void *load_guest_file(const std::string &path, const std::string &failure);

/// Loads it once more, from a copy in memory: with variables of its own. Errors likewise.
void *load_guest_copy(const std::string &path, const std::string &failure);

}  // namespace kilotwin

#endif
