/// What large swarms ask of memory: their state is larger than the caches, and touched here and
/// there.
#ifndef KILOTWIN_BASE_MEMORY_H
#define KILOTWIN_BASE_MEMORY_H

#include <sys/mman.h>

#include <boost/container/small_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace kilotwin {

struct alignas(64) CacheLine {
    uint8_t bytes[64];
};

/// So many hold `bytes`.
constexpr size_t cache_lines(size_t bytes) {
    return (bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine);
}

/// From so many robots on, they do not stay in the caches, and to fetch them early pays.
constexpr size_t FETCHED_SWARM = 2000;

/// Begins to bring the line that holds a byte into the cache.
inline void prefetch_line(const void *byte) {
    __builtin_prefetch(byte);
    // Without an effect of their own, gcc leaves out the calls of functions that only prefetch.
    asm volatile("");
}

/// The same for so many bytes from the begin of a line on.
inline void prefetch(const void *memory, size_t bytes) {
    const auto *begin = static_cast<const CacheLine *>(memory);
    for (size_t i = 0; i < cache_lines(bytes); i++) prefetch_line(begin + i);
}

/// Lays what takes a large page or more on large pages; where the system has none, nothing is lost.
template <typename T> struct LargePages {
    using value_type = T;

    LargePages() = default;
    template <typename U> LargePages(const LargePages<U> &) {}

    T *allocate(size_t count) {
        const size_t bytes = count * sizeof(T);
        void *memory = ::operator new(bytes, alignment(bytes));
        if (bytes >= PAGE) madvise(memory, bytes / PAGE * PAGE, MADV_HUGEPAGE);
        return static_cast<T *>(memory);
    }
    void deallocate(T *memory, size_t count) {
        ::operator delete(memory, alignment(count * sizeof(T)));
    }
    bool operator==(const LargePages &) const { return true; }

  private:
    static constexpr size_t PAGE = 2 << 20;
    static constexpr std::align_val_t alignment(size_t bytes) {
        return std::align_val_t(bytes >= PAGE ? PAGE : alignof(T));
    }
};

/// A list of mostly up to N, which stand where it does.
template <typename T, size_t N> using Few = boost::container::small_vector<T, N>;

/// A new last one, to be filled in where it stands: one that is put together elsewhere is copied in
/// larger pieces than it was written in, which has to wait until all of them have left the
/// processor.
template <typename List> auto &append(List &list) {
    list.emplace_back();
    return list.back();
}

/// Records of all robots.
template <typename T> using Swarm = std::vector<T, LargePages<T>>;

}  // namespace kilotwin

#endif
