// Numbers of four bytes: floats of them, quotients, and rand().
#include "robots/translated/routines/state.h"

// __floatsisf and __floatunsisf behind the sign, of a number without it.
INLINE int64_t converted(floats_t *s, translated_chip_t *chip, int64_t left) {
    uint32_t number = s->a, exponent = 0x96;
    s->cycles += 1;
    if (number >> 24 != 0) {
        const int places = 32 - translated_zeros(number >> 24);
        s->cycles += 4 + 9 * places - 1;
        exponent += (uint32_t)places;
        s->r31 = 0;
        s->r27 = (uint8_t)(number << (8 - places));
        number >>= places;
        if (!(s->r27 >> 7)) {
            s->cycles += 2;
        } else {
            s->r27 = (uint8_t)(s->r27 << 1);
            s->cycles += 1 + 1;
            if (s->r27 == 0 && !(number & 1)) {
                s->cycles += 1 + 3;
            } else {
                s->cycles += (s->r27 != 0 ? 2 : 3) + 4 + 2;
                if (++number >> 24) number = 0, exponent++;
            }
        }
    } else if (number == 0) {
        s->cycles += 2 + 3 + 3 + 3 + RET;
        s->c = (chip->flags[0] & 1u), s->z = 1, s->n = 0, s->v = 0, s->h = (chip->flags[5] & 1u);
        return s->cycles < left ? given(chip, s) : 0;
    } else {
        const uint8_t far = number >> 16 != 0 ? 0 : number >> 8 != 0 ? 1 : 2;
        static const uint8_t CYCLES[] = {2 + 1 + 1 + 1 + 2, 2 + 3 + 1 + 1 + 1 + 2 + 2 + 1,
                                         2 + 3 + 3 + 1 + 1 + 1 + 1 + 2};
        exponent -= 8u * far;
        number <<= 8 * far;
        const int places = translated_zeros(number) - 8;
        // The branches before the first turn are a brpl into the loop, and a brmi over it.
        s->cycles += CYCLES[far] + (far == 0 ? 1 + (places > 0) : 2 - (places > 0));
        if (places > 0) s->cycles += 6 * places - 1;
        exponent -= (uint32_t)places;
        number <<= places;
    }
    s->cycles += 4 + RET;
    const uint8_t top = (uint8_t)(number >> 16);
    s->a = (uint32_t)s->t << 31 | exponent << 23 | (number & MANTISSA);
    const uint8_t last = (uint8_t)(s->a >> 16);
    s->c = 0, s->z = last == 0, s->n = last >> 7, s->v = s->n, s->h = top >> 3 & 1;
    return s->cycles < left ? given(chip, s) : 0;
}

static int64_t floatsisf(translated_chip_t *chip, uint16_t sp, int64_t left,
                         const uint16_t *sites) {
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, 0)) return 0;
    s.t = is_negative(s.a);
    s.cycles = s.t ? 9 : 3;
    if (s.t) s.a = 0u - s.a;
    return converted(&s, chip, left);
}

static int64_t floatunsisf(translated_chip_t *chip, uint16_t sp, int64_t left,
                           const uint16_t *sites) {
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, 0)) return 0;
    s.cycles = 3;
    return converted(&s, chip, left);
}

// __udivmodsi4: b becomes the quotient, a the rest.
INLINE void divide_unsigned(floats_t *s) {
    const uint32_t quotient = s->a / s->b, rest = s->a % s->b;
    s->cycles += 14 + 32 * 17 + 3 * translated_ones(quotient) - 1 + 8 + RET;
    s->a = rest, s->b = quotient;
    s->r26 = (uint8_t)rest, s->r27 = (uint8_t)(rest >> 8);
    s->r30 = (uint8_t)(rest >> 16), s->r31 = (uint8_t)(rest >> 24);
    s->c = 1, s->z = quotient >> 24 == 0, s->n = is_negative(quotient), s->v = 0;
    s->h = ~quotient >> 28 & 1;
}

static int64_t udivmodsi4(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    floats_t s = taken(chip, sites);
    if (s.b == 0 || !has_room(chip, sp, 0)) return 0;
    s.t = chip->flags[6];
    divide_unsigned(&s);
    return s.cycles < left ? given(chip, &s) : 0;
}

// A number with a sign, by complements of its bytes (com, neg, sbci of 0xFF).
INLINE uint32_t negate(floats_t *s, uint32_t number) {
    increase_flags(s, ~number);
    s->cycles += 7 + RET;
    return 0u - number;
}

// __divmodsi4, whose sites are these. The site of the call that it makes last.
typedef struct {
    uint8_t negate, negate_divisor, divide, negate_quotient, negate_rest;
} quotient_sites_t;

INLINE unsigned divide_signed(floats_t *s, const quotient_sites_t *at) {
    unsigned last = at->divide;
    s->t = is_negative(s->a);
    s->r0 = (uint8_t)(s->b >> 24) ^ (s->t ? 0xFF : 0);
    s->cycles += 4;
    if (s->t) {
        call(s, at->negate);
        s->a = negate(s, s->a);
    }
    if (s->b >> 31) {
        s->cycles += 1;
        call(s, at->negate_divisor);
        s->b = negate(s, s->b);
    } else {
        s->cycles += 2;
    }
    call(s, at->divide);
    divide_unsigned(s);
    if (s->r0 >> 7) {
        s->cycles += 1;
        call(s, at->negate_quotient);
        s->b = negate(s, s->b);
        last = at->negate_quotient;
    } else {
        s->cycles += 2;
    }
    if (s->t) {
        s->cycles += 1;
        jump(s, at->negate_rest);
        s->a = negate(s, s->a);
    } else {
        s->cycles += 2 + RET;
    }
    return last;
}

static int64_t divmodsi4(translated_chip_t *chip, uint16_t sp, int64_t left,
                         const uint16_t *sites) {
    static const quotient_sites_t AT = {0, 1, 2, 3, 4};
    floats_t s = taken(chip, sites);
    if (s.b == 0 || !has_room(chip, sp, 2)) return 0;
    const unsigned last = divide_signed(&s, &AT);
    if (s.cycles >= left) return 0;
    leave_return(chip->data, sp, sites[last]);
    return given(chip, &s);
}

// __udivmodhi4, of two bytes each: r24 and r25 by r22 and r23, which become rest and quotient.
INLINE void divide_short(floats_t *s) {
    const uint32_t dividend = s->a >> 16, divisor = s->a & 0xFFFF;
    const uint32_t quotient = dividend / divisor, rest = dividend % divisor;
    s->cycles += 10 + 16 * 11 + translated_ones(quotient) - 1 + 4 + RET;
    s->a = quotient | rest << 16;
    s->b &= 0xFFFFFF;
    s->r26 = (uint8_t)rest, s->r27 = (uint8_t)(rest >> 8);
    s->c = 1, s->z = quotient >> 8 == 0, s->n = (uint8_t)(quotient >> 15), s->v = 0;
    s->h = ~quotient >> 12 & 1;
}

static int64_t udivmodhi4(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    floats_t s = taken(chip, sites);
    if ((s.a & 0xFFFF) == 0 || !has_room(chip, sp, 0)) return 0;
    s.t = chip->flags[6];
    divide_short(&s);
    return s.cycles < left ? given(chip, &s) : 0;
}

// As negate(), of two bytes.
INLINE uint32_t negate_short(floats_t *s, uint32_t number) {
    increase_flags(s, ~(number << 16));
    s->cycles += 3 + RET;
    return (0u - number) & 0xFFFF;
}

static int64_t divmodhi4(translated_chip_t *chip, uint16_t sp, int64_t left,
                         const uint16_t *sites) {
    enum { NEGATE, NEGATE_DIVISOR, DIVIDE, NEGATE_QUOTIENT };
    floats_t s = taken(chip, sites);
    if ((s.a & 0xFFFF) == 0 || !has_room(chip, sp, 2)) return 0;
    uint32_t divisor = s.a & 0xFFFF, dividend = s.a >> 16;
    unsigned last = DIVIDE;
    s.t = is_negative(s.a);
    s.r0 = (uint8_t)(divisor >> 8) ^ (s.t ? 0xFF : 0);
    s.cycles = 4;
    if (s.t) {
        call(&s, NEGATE);
        dividend = negate_short(&s, dividend);
    }
    s.cycles += divisor >> 15 ? 1 : 2;
    if (divisor >> 15) {
        call(&s, NEGATE_DIVISOR);
        divisor = negate_short(&s, divisor);
    }
    s.a = divisor | dividend << 16;
    call(&s, DIVIDE);
    divide_short(&s);
    s.cycles += s.r0 >> 7 ? 1 : 2;
    if (s.r0 >> 7) {
        call(&s, NEGATE_QUOTIENT);
        s.a = (s.a & 0xFFFF0000) | negate_short(&s, s.a & 0xFFFF);
        last = NEGATE_QUOTIENT;
    }
    if (s.t) {
        s.cycles += 1;
        s.a = (s.a & 0xFFFF) | negate_short(&s, s.a >> 16) << 16;
    } else {
        s.cycles += 2 + RET;
    }
    if (s.cycles >= left) return 0;
    leave_return(chip->data, sp, sites[last]);
    return given(chip, &s);
}

// Writes a byte of SRAM, as WRITE_SRAM() of translated/code.h.
static void write(translated_chip_t *chip, uint16_t address, uint8_t value) {
    const uint64_t change = (uint64_t)value - chip->data[address];
    const uint8_t is_below = (uint16_t)(chip->pass->stack - address) < BELOW;
    if (change != 0 && is_below) chip->changed |= CHANGED_BELOW;
    if (!is_below) chip->net += translated_weight(address) * change;
    chip->data[address] = value;
}

// avr-libc's do_rand(): 16807 times a number modulo 2^31 - 1, by Schrage's method.
static int64_t do_rand(translated_chip_t *chip, uint16_t sp, int64_t left, const uint16_t *sites) {
    enum { DIVIDE, TIMES_LOW, TIMES_HIGH, MULTIPLY = 9, TIMES_HIGH_WITHIN = 10, FRAME = 16 };
    enum { FIRST = 123459876, DIVISOR = 127773, FACTOR = 16807, FACTOR_HIGH = -2836 };
    enum { MULTIPLY_CYCLES = 22 + 11 + RET, PUSHED = 10 };
    static const quotient_sites_t AT = {4, 5, 6, 7, 8};
    static const uint8_t KEPT[PUSHED] = {8, 9, 10, 11, 12, 13, 14, 15, 28, 29};
    floats_t s = taken(chip, sites);
    const uint16_t at = (uint16_t)(s.a >> 16);
    if (!has_room(chip, sp, FRAME) || at < SRAM_BEGIN || at > SRAM_END_ - 4) return 0;
    if (at + 4 > sp - FRAME && at <= sp) return 0;
    const uint32_t before = number_at(chip->data + at);
    s.cycles = 2 * PUSHED + 1 + 8 + 4 + (before != 0 ? 2 : 5) + 4;
    s.a = before != 0 ? before : FIRST, s.b = DIVISOR;
    call(&s, DIVIDE);
    divide_signed(&s, &AT);
    const uint32_t high = s.b;
    const uint32_t from_low = s.a * FACTOR, from_high = high * (uint32_t)FACTOR_HIGH;
    s.cycles += 6;
    call(&s, TIMES_LOW);
    call(&s, MULTIPLY);
    s.cycles += MULTIPLY_CYCLES + 6;
    call(&s, TIMES_HIGH);
    call(&s, TIMES_HIGH_WITHIN);
    call(&s, MULTIPLY);
    s.cycles += MULTIPLY_CYCLES + 2 + RET + 2 + 4;
    const uint32_t sum = from_low + from_high;
    uint32_t next = sum;
    if (sum >> 31) {
        s.cycles += 2 + 4;
        next = sum - 0x80000001;
        const uint8_t a = (uint8_t)(sum >> 24), borrow = (sum & 0xFFFFFF) == 0;
        const uint8_t x = (uint8_t)(a - 0x80 - borrow);
        s.c = a < 0x80 + borrow, s.h = (a ^ 0x80 ^ x) >> 4 & 1;
    } else {
        s.cycles += 3;
        const uint32_t carry = ((from_low & 0xFFFFFF) + (from_high & 0xFFFFFF)) >> 24;
        add_flags(&s, (uint8_t)(from_high >> 24), (uint8_t)(from_low >> 24), (uint8_t)carry);
    }
    s.cycles += 8 + 1 + 2 * PUSHED + RET;
    if (s.cycles >= left) return 0;
    for (unsigned i = 0; i < PUSHED; i++) chip->data[sp - i] = chip->data[KEPT[i]];
    leave_return(chip->data, sp - PUSHED, sites[TIMES_HIGH]);
    leave_return(chip->data, sp - PUSHED - 2, sites[TIMES_HIGH_WITHIN]);
    leave_return(chip->data, sp - PUSHED - 4, sites[MULTIPLY]);
    for (unsigned byte = 0; byte < 4; byte++)
        write(chip, (uint16_t)(at + byte), (uint8_t)(next >> 8 * byte));
    chip->changed |= NOT_COUNTED;  // whether it is a counter's number is not looked at
    s.a = (from_high & 0xFFFF) | (next & 0x7FFF) << 16;
    s.r0 = (uint8_t)(((uint32_t)FACTOR_HIGH & 0xFF) * (high >> 16 & 0xFF));
    s.r26 = (uint8_t)(next >> 16), s.r27 = (uint8_t)(next >> 24);
    s.z = (next & 0x7F00) == 0, s.n = 0, s.v = 0;
    return given(chip, &s);
}

const translated_routine_t translated_routines[ROUTINES] = {
    [ROUTINE_ADDSF3] = translated_addsf3,   [ROUTINE_SUBSF3] = translated_subsf3,
    [ROUTINE_ADDSF3X] = translated_addsf3x, [ROUTINE_MULSF3] = translated_mulsf3,
    [ROUTINE_DIVSF3] = translated_divsf3,   [ROUTINE_CMPSF2] = translated_compare,
    [ROUTINE_GESF2] = translated_compare,   [ROUTINE_POWSER] = translated_powser,
    [ROUTINE_POWSODD] = translated_powsodd, [ROUTINE_FLOATSISF] = floatsisf,
    [ROUTINE_FLOATUNSISF] = floatunsisf,    [ROUTINE_UDIVMODHI4] = udivmodhi4,
    [ROUTINE_DIVMODHI4] = divmodhi4,        [ROUTINE_UDIVMODSI4] = udivmodsi4,
    [ROUTINE_DIVMODSI4] = divmodsi4,        [ROUTINE_DO_RAND] = do_rand,
};
