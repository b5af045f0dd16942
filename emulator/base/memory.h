/// Layout of records in memory.
#ifndef KILOTWIN_BASE_MEMORY_H
#define KILOTWIN_BASE_MEMORY_H

#include <boost/container/small_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace kilotwin {

/// 64 bytes that begin where a cache line does. Guests' state is allocated in these, so that two
/// robots never share a line.
struct alignas(64) CacheLine {
    uint8_t bytes[64];
};

/// The number of cache lines that hold `bytes`.
constexpr size_t cache_lines(size_t bytes) {
    return (bytes + sizeof(CacheLine) - 1) / sizeof(CacheLine);
}

/// A list whose first N items lie in the object itself; more are allocated.
template <typename T, size_t N> using Few = boost::container::small_vector<T, N>;

/// Records of all robots, by index.
template <typename T> using Swarm = std::vector<T>;

}  // namespace kilotwin

#endif
