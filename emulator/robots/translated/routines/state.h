/// State that the routines of translated/routines/routines.h share: the registers that they go
/// through, flags, and what calls leave on the stack.
///
/// Floats are avr-libc's: a in r22 to r25, b in r18 to r21, the lowest byte first; r27 and r26 are
/// bytes below their lowest ones, r31 and r30 what is below that. Cycles are written down as they
/// add up along the code: a branch that is taken has two.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_ROUTINES_STATE_H
#define KILOTWIN_ROBOTS_TRANSLATED_ROUTINES_STATE_H

#include <stdint.h>

#include "robots/translated/code.h"
#include "robots/translated/routines/routines.h"

enum { MANTISSA = 0x7FFFFF, IMPLICIT = 0x800000, SIGN = 1u << 31, EXPONENT = 0xFF };
enum {
    SRAM_BEGIN = 0x100,
    SRAM_END_ = 0x900,
    SHORT_CALL = 3,
    SHORT_JUMP = 2,
    RET = 4,
    PUSHES = 24
};

// All of a routine is one function: what it computes stays in registers of this computer.
#define INLINE static inline __attribute__((always_inline))

// Registers and flags that floats go through. Flags as C Z N V S H T.
typedef struct {
    uint32_t a, b;
    uint32_t r0, r26, r27, r30, r31;
    uint32_t c, z, n, v, h, t;
    int64_t cycles;
    const uint16_t *sites;
} floats_t;

INLINE uint8_t is_normal(uint32_t number) { return (uint8_t)((number >> 23 & 0xFF) - 1u < 0xFE); }
INLINE uint8_t is_negative(uint32_t number) { return (uint8_t)(number >> 31); }
INLINE uint32_t exponent_of(uint32_t number) { return number >> 23 & EXPONENT; }

INLINE uint32_t number_at(const uint8_t *at) {
    return at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16 | (uint32_t)at[3] << 24;
}
INLINE void put_number(uint8_t *at, uint32_t number) {
    for (unsigned byte = 0; byte < 4; byte++) at[byte] = (uint8_t)(number >> 8 * byte);
}

INLINE void call(floats_t *s, unsigned site) { s->cycles += SHORT_CALL + (s->sites[site] >> 15); }
INLINE void jump(floats_t *s, unsigned site) { s->cycles += SHORT_JUMP + (s->sites[site] >> 15); }

// The return address of a call, whose bytes stay below the stack pointer.
INLINE void leave_return(uint8_t *data, uint16_t sp, uint16_t site) {
    data[sp] = (uint8_t)site;
    data[sp - 1] = (uint8_t)(site >> 8 & 0x7F);
}

// Flags of a sum of two bytes, and of the number that is increased by 1 (subi and sbci of 0xFF).
INLINE void add_flags(floats_t *s, uint8_t a, uint8_t b, uint8_t carry) {
    const unsigned sum = (unsigned)a + b + carry;
    const uint8_t x = (uint8_t)sum;
    s->c = sum >> 8 & 1, s->z = x == 0, s->n = x >> 7;
    s->v = ((a ^ x) & (b ^ x)) >> 7, s->h = (a ^ b ^ x) >> 4 & 1;
}
INLINE void increase_flags(floats_t *s, uint32_t before) {
    const uint8_t a = (uint8_t)(before >> 24), borrow = (before & 0xFFFFFF) != 0xFFFFFF;
    const uint8_t x = (uint8_t)(a + 1 - borrow);
    s->c = a < 0xFF + borrow, s->z = before == UINT32_MAX, s->n = x >> 7;
    s->v = ((a ^ 0xFF) & (a ^ x)) >> 7, s->h = (a ^ 0xFF ^ x) >> 4 & 1;
}

// Whether a routine may be computed, of `stack` bytes below the pointer. r1 is 0 in C.
INLINE uint8_t has_room(const translated_chip_t *chip, uint16_t sp, unsigned stack) {
    return sp >= SRAM_BEGIN + stack && sp < SRAM_END_ - 2 && chip->numbers[2] >> 24 == 0;
}

INLINE floats_t taken(const translated_chip_t *chip, const uint16_t *sites) {
    const uint32_t low = chip->numbers[2], pointer = chip->numbers[3];
    floats_t s;
    s.a = chip->numbers[0], s.b = chip->numbers[1];
    s.r0 = low & 0xFF, s.r26 = low >> 8 & 0xFF, s.r27 = low >> 16 & 0xFF;
    s.r30 = pointer & 0xFF, s.r31 = pointer >> 8 & 0xFF;
    s.c = s.z = s.n = s.v = s.h = s.t = 0;
    s.cycles = 0;
    s.sites = sites;
    return s;
}

INLINE int64_t given(translated_chip_t *chip, const floats_t *s) {
    chip->numbers[0] = s->a, chip->numbers[1] = s->b;
    chip->numbers[2] = s->r0 | s->r26 << 8 | s->r27 << 16;
    chip->numbers[3] = s->r30 | s->r31 << 8 | s->c << 16 | s->z << 17 | s->n << 18 | s->v << 19 |
                       (s->n ^ s->v) << 20 | s->h << 21 | s->t << 22;
    return s->cycles;
}

// Those of floats, for the table of all.
translated_compute_t translated_addsf3, translated_subsf3, translated_addsf3x, translated_mulsf3,
    translated_divsf3, translated_compare, translated_powser, translated_powsodd;

#endif
