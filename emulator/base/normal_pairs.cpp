#include "base/normal_pairs.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace kilotwin {

#ifdef __SSE2__

NormalPairs::NormalPairs(const Chance &chance) {
    auto a = static_cast<uint32_t>(chance.seed()), b = static_cast<uint32_t>(chance.seed() >> 32);
    for (RoundKeys &keys : round_keys_) {
        keys = {{a, a}, {b, b}};
        a += PHILOX_W32_0;
        b += PHILOX_W32_1;
    }
}

// Both blocks go through Philox' rounds side by side; then the halves of their words are summed.
std::array<double, 2> NormalPairs::draw(uint32_t robot, std::array<Purpose, 2> purposes,
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
        b = other;  // upper halves of lanes are left as they are: no product reads them
        d = one;
    }
    const __m128i half = _mm_set1_epi32(0xFFFF);
    __m128i sums = _mm_setzero_si128();
    for (const __m128i word : {a, b, c, d})
        sums =
            _mm_add_epi32(sums, _mm_add_epi32(_mm_and_si128(word, half), _mm_srli_epi32(word, 16)));
    const __m128i lower = _mm_shuffle_epi32(sums, _MM_SHUFFLE(3, 1, 2, 0));
    std::array<double, 2> normals;
    _mm_storeu_pd(normals.data(),
                  _mm_mul_pd(_mm_sub_pd(_mm_cvtepi32_pd(lower), _mm_set1_pd(Chance::MEAN_OF_EIGHT)),
                             _mm_set1_pd(Chance::SCALE)));
    return normals;
}

#else

NormalPairs::NormalPairs(const Chance &chance) : chance_(chance) {}

std::array<double, 2> NormalPairs::draw(uint32_t robot, std::array<Purpose, 2> purposes,
                                        uint64_t n) const {
    return {chance_.normal(robot, purposes[0], n), chance_.normal(robot, purposes[1], n)};
}

#endif

}  // namespace kilotwin
