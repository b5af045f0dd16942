/// Routines of avr-libc and libgcc that a translation hands to the engine, for speed alone: floats,
/// divisions and rand(). Each is computed by a few numbers of this computer, and ends as the
/// machine code does: the same registers, flags, bytes below the stack pointer, and cycles.
///
/// The translator knows a routine by its instructions
/// (host_tools/kilotwin/programs/translate/routines.py), so that these are of one version of each
/// library: another one's code is executed as it is. So is a call whose operands are rare
/// (infinity, results that are no normal numbers), or that an interrupt may come in the midst of.
///
/// The plain twin is that code (tests/translation/test_routines.py).
#ifndef KILOTWIN_ROBOTS_TRANSLATED_ROUTINES_ROUTINES_H
#define KILOTWIN_ROBOTS_TRANSLATED_ROUTINES_ROUTINES_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct translated_chip;

/// Computes the routine that begins, by the registers in the chip's data space. `sites` are the
/// routine's calls and jumps: the word address behind each, and ROUTINE_LONG if it takes a cycle
/// more. Cycles up to behind its return, which is not done; 0: it has to be executed, and nothing
/// has changed.
typedef int64_t translated_compute_t(struct translated_chip *chip, uint16_t sp, int64_t left,
                                     const uint16_t *sites);
typedef translated_compute_t *translated_routine_t;

enum { ROUTINE_LONG = 1 << 15 };

/// In the order of translated_routines.
enum {
    ROUTINE_ADDSF3,
    ROUTINE_SUBSF3,
    ROUTINE_ADDSF3X,
    ROUTINE_MULSF3,
    ROUTINE_DIVSF3,
    ROUTINE_CMPSF2,
    ROUTINE_GESF2,
    ROUTINE_POWSER,
    ROUTINE_POWSODD,
    ROUTINE_FLOATSISF,
    ROUTINE_FLOATUNSISF,
    ROUTINE_UDIVMODHI4,
    ROUTINE_DIVMODHI4,
    ROUTINE_UDIVMODSI4,
    ROUTINE_DIVMODSI4,
    ROUTINE_DO_RAND,
    ROUTINES
};

/// All of them.
extern const translated_routine_t translated_routines[ROUTINES];

#ifdef __cplusplus
}
#endif

/// Four registers as a number, the lowest byte first. Those of a routine: r22 to r25; r18 to r21;
/// r0, r26, r27, r1; r30, r31 and, when it is done, flags as in the status register.
#define NUMBER(r_0, r_1, r_2, r_3) \
    ((uint32_t)(r_0) | (uint32_t)(r_1) << 8 | (uint32_t)(r_2) << 16 | (uint32_t)(r_3) << 24)
/// Stands in translated code (translated/code.h) where a routine begins. `give` and `take` copy
/// registers to and from `numbers`; `counted` are bits for `changed`, of instructions of it that
/// reach a counter. Flags that it leaves as they are are in the state.
#define ROUTINE(which, sites, counted, give, take)                                     \
    if (chip->routines != 0) {                                                         \
        give F[0] = (uint8_t)cf, F[5] = hr >> 4 & 1, F[6] = (uint8_t)tf;               \
        chip->net = net, chip->changed = changed;                                      \
        const int64_t took_ = chip->routines[ROUTINE_##which](chip, sp, left, sites);  \
        if (took_ != 0) {                                                              \
            uint32_t n_;                                                               \
            take n_ = chip->numbers[3] >> 16;                                          \
            cf = n_ & 1u, zr = ~n_ & 2, nr = (uint8_t)(n_ << 5);                       \
            vr = (uint8_t)(n_ << 4), sr = (uint8_t)(n_ << 3), hr = (uint8_t)(n_ >> 1); \
            tf = n_ >> 6 & 1u, net = chip->net;                                        \
            changed = (uint8_t)(chip->changed | (counted));                            \
            sp = (uint16_t)(sp + 2);                                                   \
            RETURNED                                                                   \
            GO_TO((uint32_t)(M[sp - 1] << 8 | M[sp]) * 2, took_);                      \
        }                                                                              \
    }

#endif
