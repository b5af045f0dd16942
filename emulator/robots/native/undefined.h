/// Undefined behaviour of guests that were built to look for it, as texts for the run folder.
#ifndef KILOTWIN_ROBOTS_NATIVE_UNDEFINED_H
#define KILOTWIN_ROBOTS_NATIVE_UNDEFINED_H

#include <cstdint>
#include <string>

namespace kilotwin {

/// The words for KT_UB_... (abi.h), as `index 12 out of bounds for type uint8_t [10]`. `data` is
/// the description that gcc and clang lay down for their undefined-behaviour checks, `first` and
/// `second` are the values as those hand them over: whole numbers of up to 64 bits, or addresses.
std::string undefined_text(uint8_t what, const void *data, uint64_t first, uint64_t second);

}  // namespace kilotwin

#endif
