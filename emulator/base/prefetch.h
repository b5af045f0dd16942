/// Prefetching for swarms that outgrow the caches: the only place that knows how, and from which
/// size on.
///
/// Loops over robots touch about 2 KB of each, here and there. While such a loop handles one robot,
/// it prefetches what it will touch some turns later. Results do not depend on it: test_prefetch
/// compares runs with and without. `walk` with 10,000 robots takes 1.3 to 1.5 times as long without
/// (docs/performance.md). With 1000 robots, which stay in the caches, prefetching costs 3 to 7 %.
#ifndef KILOTWIN_BASE_PREFETCH_H
#define KILOTWIN_BASE_PREFETCH_H

#include <cstddef>

#include "base/memory.h"

namespace kilotwin {

/// Swarms of at least so many robots are prefetched. Tests alone change it, between runs: 0 for all
/// swarms, SIZE_MAX for none.
inline size_t prefetched_swarm = 2000;

/// Whether loops over a swarm of `robots` are to prefetch. Cost: a load and a comparison.
inline bool prefetches(size_t robots) { return robots >= prefetched_swarm; }

/// Starts to load the cache line that holds `byte`, which need not be mapped. Does not wait.
inline void prefetch_line(const void *byte) {
    __builtin_prefetch(byte);
    // Without a side effect of their own, gcc drops calls of functions that only prefetch.
    asm volatile("");
}

/// The same for all lines of `bytes` from `memory` on, which begins a cache line.
inline void prefetch_bytes(const void *memory, size_t bytes) {
    const auto *begin = static_cast<const CacheLine *>(memory);
    for (size_t i = 0; i < cache_lines(bytes); i++) prefetch_line(begin + i);
}

/// The same for an object no longer than two lines, which may begin anywhere in one.
template <typename T> void prefetch_object(const T &object) {
    const auto *begin = reinterpret_cast<const char *>(&object);
    prefetch_line(begin);
    prefetch_line(begin + sizeof(T) - 1);
}

}  // namespace kilotwin

#endif
