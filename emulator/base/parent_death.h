/// A worker's end when its parent ends, whatever it is doing by then.
#ifndef KILOTWIN_BASE_PARENT_DEATH_H
#define KILOTWIN_BASE_PARENT_DEATH_H

namespace kilotwin {

/// Arranges for this process to be killed `grace_s` seconds after the process `parent` has ended;
/// with 0 at once. Within that time a worker that notices the end itself may leave its files in
/// order. Ends the process at once if `parent` is not its parent any more.
///
/// To be called once, by a process that lives for its parent, before it runs anything that may
/// hang. With 0 the parent's end is that of the thread which started this process. With more a
/// child of this process waits for it, from which no program of a robot can hide.
/// EngineError where the kernel refuses.
void end_with_parent(int parent, double grace_s);

}  // namespace kilotwin

#endif
