/// All chance of the engine: one counter-based generator (Philox 4x32-10), keyed by seed, robot and
/// purpose.
///
/// The n-th draw of a purpose depends on nothing else, so another robot or another source of noise
/// never shifts anybody's luck.
#ifndef KILOTWIN_BASE_CHANCE_H
#define KILOTWIN_BASE_CHANCE_H

#include <Random123/philox.h>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <array>
#include <cstdint>

namespace kilotwin {

/// What a draw is for. Numbers are part of "same seed, same result": never reuse one.
enum class Purpose : uint32_t {
    PLACE = 1,
    HEADING = 2,
    POWER_UP = 3,
    RAND_HARD = 4,
    CLOCK = 5,
    RANGE = 6,
    SENSITIVITY = 7,
    FRAME_LOSS = 8,
    LOW_GAIN = 9,
    HIGH_GAIN = 10,
    SPEED = 11,
    LEFT_BIAS = 12,
    RIGHT_BIAS = 13,
    LEFT_NOISE = 14,
    RIGHT_NOISE = 15,
    LIGHT = 16,
    CONVERTER_NOISE = 32,
    LOST_PULSE = 33,
    MODULE_RAND_HARD = 40,
    MODULE_CONVERTER_NOISE = 41,
    MODULE_POWER_UP = 48,
    MODULE_CLOCK = 49,
    WEAK_LIGHT = 50,
    CELL_LOSS = 51,
    CAN_ERROR = 64,
    DIFFERENTIAL_INPUT = 72,
};

class Chance {
  public:
    explicit Chance(uint64_t seed) : seed_(seed) {
        auto a = static_cast<uint32_t>(seed), b = static_cast<uint32_t>(seed >> 32);
        for (RoundKeys &keys : round_keys_) {
            keys = {{a, a}, {b, b}};
            a += PHILOX_W32_0;
            b += PHILOX_W32_1;
        }
    }

    /// The n-th draw of `robot` for `purpose`: 64 uniform bits.
    uint64_t bits(uint32_t robot, Purpose purpose, uint64_t n) const {
        const auto out = block(robot, purpose, n);
        return static_cast<uint64_t>(out[1]) << 32 | out[0];
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    double uniform(uint32_t robot, Purpose purpose, uint64_t n) const {
        return static_cast<double>(bits(robot, purpose, n) >> 11) * 0x1p-53;
    }

    /// Mean 0, variance 1, nearly normal: the sum of eight uniform numbers, so at most 4.9 in size.
    double normal(uint32_t robot, Purpose purpose, uint64_t n) const {
        uint32_t sum = 0;
        for (const uint32_t word : block(robot, purpose, n)) sum += (word & 0xFFFF) + (word >> 16);
        return (static_cast<double>(sum) - MEAN_OF_EIGHT) * SCALE;
    }

    /// normal() for two purposes, in less time than twice.
    std::array<double, 2> normals(uint32_t robot, std::array<Purpose, 2> purposes,
                                  uint64_t n) const;

  private:
    // From the sum of eight numbers of 16 bits to a normal one.
    static constexpr double MEAN_OF_EIGHT = 4 * 0xFFFF;
    static constexpr double SCALE = 1.224744871391589 * 0x1p-16;  // sqrt(12 / 8)

    /// Of each of the ten rounds that two blocks go through side by side.
    struct alignas(16) RoundKeys {
        uint64_t a[2], b[2];
    };

    r123::Philox4x32::ctr_type block(uint32_t robot, Purpose purpose, uint64_t n) const {
        const r123::Philox4x32::ctr_type counter = {{static_cast<uint32_t>(n),
                                                     static_cast<uint32_t>(n >> 32), robot,
                                                     static_cast<uint32_t>(purpose)}};
        const r123::Philox4x32::key_type key = {
            {static_cast<uint32_t>(seed_), static_cast<uint32_t>(seed_ >> 32)}};
        return r123::Philox4x32()(counter, key);
    }

    uint64_t seed_;
    std::array<RoundKeys, 10> round_keys_;
};

#ifdef __SSE2__
// Two blocks side by side: each word of a counter is the lower half of a lane, whose upper half
// does not count.
inline std::array<double, 2> Chance::normals(uint32_t robot, std::array<Purpose, 2> purposes,
                                             uint64_t n) const {
    auto both = [](uint64_t word) { return _mm_set1_epi64x(static_cast<int64_t>(word)); };
    auto upper = [](__m128i lanes) { return _mm_shuffle_epi32(lanes, _MM_SHUFFLE(3, 3, 1, 1)); };
    auto key = [](const uint64_t(&lanes)[2]) {
        return _mm_load_si128(reinterpret_cast<const __m128i *>(lanes));
    };
    const __m128i first = both(PHILOX_M4x32_0), second = both(PHILOX_M4x32_1);
    __m128i a = both(n), b = both(n >> 32), c = both(robot);
    __m128i d =
        _mm_set_epi64x(static_cast<uint32_t>(purposes[1]), static_cast<uint32_t>(purposes[0]));
    for (const RoundKeys &keys : round_keys_) {
        const __m128i one = _mm_mul_epu32(a, first), other = _mm_mul_epu32(c, second);
        a = _mm_xor_si128(_mm_xor_si128(upper(other), b), key(keys.a));
        c = _mm_xor_si128(_mm_xor_si128(upper(one), d), key(keys.b));
        b = other;
        d = one;
    }
    const __m128i half = _mm_set1_epi32(0xFFFF);
    __m128i sums = _mm_setzero_si128();
    for (const __m128i word : {a, b, c, d})
        sums =
            _mm_add_epi32(sums, _mm_add_epi32(_mm_and_si128(word, half), _mm_srli_epi32(word, 16)));
    const __m128d two = _mm_cvtepi32_pd(_mm_shuffle_epi32(sums, _MM_SHUFFLE(3, 1, 2, 0)));
    std::array<double, 2> normals;
    _mm_storeu_pd(normals.data(),
                  _mm_mul_pd(_mm_sub_pd(two, _mm_set1_pd(MEAN_OF_EIGHT)), _mm_set1_pd(SCALE)));
    return normals;
}
#else
inline std::array<double, 2> Chance::normals(uint32_t robot, std::array<Purpose, 2> purposes,
                                             uint64_t n) const {
    return {normal(robot, purposes[0], n), normal(robot, purposes[1], n)};
}
#endif

}  // namespace kilotwin

#endif
