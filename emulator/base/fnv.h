/// FNV-1a hashes of 64 bits, by bytes or by words of eight.
#ifndef KILOTWIN_BASE_FNV_H
#define KILOTWIN_BASE_FNV_H

#include <cstddef>
#include <cstdint>

namespace kilotwin {

constexpr uint64_t FNV_OFFSET = 0xCBF29CE484222325u;  ///< a hash of nothing
constexpr uint64_t FNV_PRIME = 0x100000001B3u;

/// FNV-1a: each byte into the low end, then a product that spreads it upwards.
inline void take_bytes(uint64_t &hash, const void *data, size_t bytes) {
    for (size_t i = 0; i < bytes; i++)
        hash = (hash ^ static_cast<const uint8_t *>(data)[i]) * FNV_PRIME;
}

/// Eight bytes at once. The shift lets high bits reach low ones, which a product alone does not.
inline void take_word(uint64_t &hash, uint64_t word) {
    hash = (hash ^ word) * FNV_PRIME;
    hash ^= hash >> 29;
}

}  // namespace kilotwin

#endif
