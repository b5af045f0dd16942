/// What large swarms ask of memory: their state is larger than the caches, and touched here and
/// there.
#ifndef KILOTWIN_ENGINE_MEMORY_H
#define KILOTWIN_ENGINE_MEMORY_H

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>

namespace kilotwin {

struct alignas(64) CacheLine {
    uint8_t bytes[64];
};

/// So many hold `bytes`.
constexpr size_t cache_lines(size_t bytes) {
    return (bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine);
}

/// Begins to bring memory into the cache.
inline void prefetch(const void *memory, size_t bytes) {
    const auto *begin = static_cast<const CacheLine *>(memory);
    for (size_t i = 0; i < cache_lines(bytes); i++) __builtin_prefetch(begin + i);
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
