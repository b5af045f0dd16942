/// A loop that never changes: speeds are told as ratios to it, so that machines can be compared.
#ifndef KILOTWIN_BASE_REFERENCE_LOOP_H
#define KILOTWIN_BASE_REFERENCE_LOOP_H

namespace kilotwin {

/// Goes through the loop and returns the CPU time of this thread that it took, in s: some 40 ms.
/// Each of its twelve million turns multiplies and adds, looks into a table of 32 KB, and branches
/// that cannot be predicted, about as the engine does.
double reference_loop_s();

}  // namespace kilotwin

#endif
