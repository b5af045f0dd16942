/// Closed forms of a guest's inner loops, which leave out all iterations but the last one or two,
/// for speed alone (docs/passes.md, 4): the loops are those of
/// host_tools/kilotwin/build/avr_loops.py. Each macro stands where the loop's first block begins,
/// in any turn; it does nothing where an interrupt may come before the end. The last turn sets the
/// flags, and the branches back are taken in all that are left out.
///
/// The plain twin of each is the code itself, turn by turn, as translations execute it that are
/// marked for coverage (tests/translation/test_loops.py).
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PASSES_LOOPS_H
#define KILOTWIN_ROBOTS_TRANSLATED_PASSES_LOOPS_H

#include <stdint.h>

/// A block that counts down to 0: all of its turns but two, as far as cycles go. `bits` has the
/// counter, 0 is as many as it can count; `back` sets it to n_.
#define COUNT_DOWN(value, bits, cycles, back)                       \
    do {                                                            \
        const uint32_t c_ = (value);                                \
        const uint64_t all_ = c_ != 0 ? c_ : (uint64_t)1 << (bits); \
        const uint64_t room_ = (uint64_t)left / (cycles);           \
        const uint64_t do_ = all_ < room_ ? all_ : room_;           \
        if (do_ > 2) {                                              \
            const uint64_t n_ = all_ - (do_ - 2);                   \
            left -= (int64_t)((do_ - 2) * (cycles));                \
            back                                                    \
        }                                                           \
    } while (0);

/// Zeros in front of a number, which is not 0; tcc has no function of its own for that.
static inline int translated_zeros(uint32_t number) {
#ifdef __TINYC__
    int zeros = 0;
    for (int bits = 16; bits > 0; bits /= 2)
        if (number >> (32 - bits) == 0) zeros += bits, number <<= bits;
    return zeros;
#else
    return __builtin_clz(number);
#endif
}

/// A block that shifts a number of `bits` to the left, and counts down, until its highest bit is
/// set. Bit 31 of rest_ is the second highest, which the next shift makes the highest, so that as
/// many turns are left out as there are zeros in front. `back` sets the number to v_, the counter
/// to n_. 0 would never come to an end.
#define NORMALISE(value, bits, cycles, count, back)                   \
    do {                                                              \
        uint32_t v_ = (value);                                        \
        const uint32_t rest_ = v_ << (32 - (bits)) << 1;              \
        const int turns_ = rest_ != 0 ? translated_zeros(rest_) : 0;  \
        if (turns_ > 0 && left > (turns_ + 1) * (cycles)) {           \
            const uint32_t n_ = (uint32_t)(count) - (uint32_t)turns_; \
            left -= turns_ * (cycles);                                \
            v_ <<= turns_;                                            \
            back                                                      \
        }                                                             \
    } while (0);

/// Bits that are set. The compiler's own would be a call, as of computers without an instruction.
static inline int translated_ones(uint32_t bits) {
    bits -= bits >> 1 & 0x55555555;
    bits = (bits & 0x33333333) + (bits >> 2 & 0x33333333);
    return (int)(((bits + (bits >> 4)) & 0x0F0F0F0F) * 0x01010101 >> 24);
}

/// turns_ of a restoring division at once: rest, divisor and what is shifted into the rest
/// meanwhile, `in`, are a division of this computer, whose quotient has a bit for each turn. The
/// rest is less than the divisor; where the divisor's highest bit is clear, or nothing is in the
/// rest yet, no bit is lost at the top. The code's quotient gets the bits inverted. A turn takes so
/// many cycles with and without a subtraction. `back` sets registers to rest_ and bits_.
#define DIVIDE_(rest, divisor, quotient, bits, with, without, in, back)                     \
    do {                                                                                    \
        const uint64_t r_ = (rest), d_ = (divisor);                                         \
        if (turns_ > 0 && r_ < d_ && (d_ >> ((bits)-1) == 0 || r_ == 0)) {                  \
            const uint64_t n_ = r_ << turns_ | (in), q_ = n_ / d_;                          \
            const int ones_ = translated_ones((uint32_t)q_);                                \
            const int64_t spent_ = ones_ * (with) + (turns_ - ones_) * (without);           \
            if (left > spent_ + (with) + (without)) {                                       \
                const uint64_t rest_ = n_ - q_ * d_;                                        \
                const uint64_t bits_ =                                                      \
                    (uint64_t)(quotient) << turns_ | (~q_ & (((uint64_t)1 << turns_) - 1)); \
                left -= spent_;                                                             \
                back                                                                        \
            }                                                                               \
        }                                                                                   \
    } while (0);

/// Turns up to the one that shifts the quotient's mark out, its highest bit: zeros come in.
#define DIVIDE_TO_MARK(rest, divisor, quotient, bits, with, without, back)        \
    {                                                                             \
        const int turns_ = (quotient) != 0 ? translated_zeros(quotient) - 24 : 0; \
        DIVIDE_(rest, divisor, quotient, bits, with, without, (uint64_t)0, back)  \
    }

/// Turns up to the one that the counter ends with. The carry comes in first, then the bits that
/// leave the quotient's registers; behind the last one the carry is the next of these.
#define DIVIDE_BY_COUNT(rest, divisor, quotient, count, bits, with, without, back)           \
    {                                                                                        \
        const int turns_ = (count) > 1 && (count) <= (bits) ? (count)-1 : 0;                 \
        const uint64_t all_ = (uint64_t)cf << (bits) | (uint32_t)(quotient);                 \
        DIVIDE_(rest, divisor, quotient, bits, with, without, all_ >> ((bits) + 1 - turns_), \
                back cf = all_ >> ((bits)-turns_) & 1;                                       \
                (count) = 1;)                                                                \
    }

/// Stands where a division of a guest begins, or in any turn of it.
#define DIVIDES_BY(at, divisor)                              \
    if (__builtin_expect((divisor) == 0, 0)) {               \
        M[0x5D] = (uint8_t)sp, M[0x5E] = (uint8_t)(sp >> 8); \
        chip->left = left, chip->pc = (at);                  \
        chip->divides_by_zero(chip);                         \
    }

#endif
