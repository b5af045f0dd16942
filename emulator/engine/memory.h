/// What large swarms ask of memory: their state is larger than the caches, and touched here and
/// there.
#ifndef KILOTWIN_ENGINE_MEMORY_H
#define KILOTWIN_ENGINE_MEMORY_H

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace kilotwin {

/// Begins to bring memory into the cache.
inline void prefetch(const void *memory, size_t bytes) {
    constexpr size_t CACHE_LINE = 64;
    const auto *begin = static_cast<const char *>(memory);
    for (size_t i = 0; i < bytes; i += CACHE_LINE) __builtin_prefetch(begin + i);
}

/// To be called before it is first touched; where the system has no large pages, nothing happens.
inline void prefer_large_pages(void *memory, size_t bytes) {
    constexpr uintptr_t PAGE = 2 << 20;
    const auto at = reinterpret_cast<uintptr_t>(memory);
    const uintptr_t begin = (at + PAGE - 1) / PAGE * PAGE, end = (at + bytes) / PAGE * PAGE;
    if (begin < end) madvise(reinterpret_cast<void *>(begin), end - begin, MADV_HUGEPAGE);
}

}  // namespace kilotwin

#endif
