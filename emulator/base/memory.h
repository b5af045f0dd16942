/// Layout of records in memory: what lies on one cache line, copies of owned parts.
/// A robot has about 2 KB of records; swarms of a million are to fit into 2 GB.
#ifndef KILOTWIN_BASE_MEMORY_H
#define KILOTWIN_BASE_MEMORY_H

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "base/large_pages.h"

namespace kilotwin {

/// 64 bytes that begin where a cache line does. Guests' state is allocated in these, so that two
/// robots never share a line.
struct alignas(64) CacheLine {
    uint8_t bytes[64];
};

/// The number of cache lines that hold `bytes`; 0 for none. For allocations in CacheLine and for
/// prefetching.
constexpr size_t cache_lines(size_t bytes) {
    return (bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine);
}

/// A std::unique_ptr whose copy has a copy of the object. For parts of a record that few have.
template <typename T> class Own : public std::unique_ptr<T> {
  public:
    using std::unique_ptr<T>::unique_ptr;
    template <typename... Arguments> static Own make(Arguments &&...arguments) {
        return Own(new T(std::forward<Arguments>(arguments)...));
    }
    Own() = default;
    Own(const Own &other) : std::unique_ptr<T>(other ? new T(*other) : nullptr) {}
    Own &operator=(const Own &other) {
        if (*this || other) this->reset(other ? new T(*other) : nullptr);
        return *this;
    }
    Own(Own &&) noexcept = default;
    Own &operator=(Own &&) noexcept = default;
    ~Own() = default;
};

/// Records of all robots, by index, on large pages where there are many. They never grow during a
/// run, so that references into them stay valid.
template <typename T> using Swarm = std::vector<T, LargePages<T>>;

}  // namespace kilotwin

#endif
