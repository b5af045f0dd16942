/// An allocator that lays long arrays on large pages: with swarms of 10,000 robots and more the
/// processor's translation buffer (TLB) is too small for pages of 4 KB. Brings 5 % or more of
/// `walk` there (docs/performance.md). std::allocator is its plain twin: results do not depend on
/// it.
#ifndef KILOTWIN_BASE_LARGE_PAGES_H
#define KILOTWIN_BASE_LARGE_PAGES_H

#include <sys/mman.h>

#include <cstddef>
#include <new>

namespace kilotwin {

/// An allocator for std::vector, behind Swarm (base/memory.h).
///
/// Arrays of a large page (2 MB) or more begin on one, and the kernel is asked for large pages; it
/// may refuse, and nothing is lost. Shorter arrays are allocated as usual.
template <typename T> struct LargePages {
    using value_type = T;

    /// No state: all objects are equal, whatever they allocate.
    LargePages() = default;
    /// Containers convert it to the type of their nodes.
    template <typename U> LargePages(const LargePages<U> &) {}

    /// Memory for `count` objects, which are not constructed; std::bad_alloc if there is none. A
    /// refusal of large pages is no error.
    T *allocate(size_t count) {
        const size_t bytes = count * sizeof(T);
        void *memory = ::operator new(bytes, alignment(bytes));
        if (bytes >= PAGE) madvise(memory, bytes / PAGE * PAGE, MADV_HUGEPAGE);
        return static_cast<T *>(memory);
    }
    /// Frees what allocate() gave for the same `count`. Never throws.
    void deallocate(T *memory, size_t count) {
        ::operator delete(memory, alignment(count * sizeof(T)));
    }
    bool operator==(const LargePages &) const { return true; }

  private:
    /// A large page of x86-64, 2 MB. With pages of another size only the alignment is in vain.
    static constexpr size_t PAGE = 2 << 20;
    /// Where an array of so many bytes begins: on a page of its own, or as usual.
    static constexpr std::align_val_t alignment(size_t bytes) {
        return std::align_val_t(bytes >= PAGE ? PAGE : alignof(T));
    }
};

}  // namespace kilotwin

#endif
