// Floats: sums, products, quotients, comparisons, and series of them.
#include "robots/translated/routines/state.h"

// __fp_split3 up to the branch behind it; the sign of the product to T.
INLINE void split(floats_t *s, unsigned site) {
    const int is_zero_a = exponent_of(s->a) == 0, is_zero_b = exponent_of(s->b) == 0;
    call(s, site);
    s->cycles += 19 + 5 * (is_zero_a + is_zero_b) + 1;
    s->t = is_negative(s->a ^ s->b);
}

// Two numbers of 40 bits without sign, by exponent and 32 bits of mantissa; `places` is what r21,
// b's exponent, is left with.
typedef struct {
    uint32_t a, b, ea, eb, places;
} operands_t;

INLINE operands_t operands(floats_t *s, unsigned split_site) {
    operands_t o = {(s->a & MANTISSA) << 8 | s->r27, (s->b & MANTISSA) << 8 | s->r26,
                    exponent_of(s->a), exponent_of(s->b), 0};
    s->r30 = s->a >> 24;
    s->cycles += 1;
    split(s, split_site);
    o.a |= o.ea != 0 ? SIGN : 0, o.b |= o.eb != 0 ? SIGN : 0;
    o.ea += o.ea == 0 && o.a >> 8 != 0, o.eb += o.eb == 0 && o.b >> 8 != 0;
    o.places = o.eb;
    s->cycles += 5;
    return o;
}

// Two equal numbers of other signs: __fp_zero.
INLINE void cancel(floats_t *s, const operands_t *o, unsigned zero_site) {
    s->cycles += 1;
    jump(s, zero_site);
    s->cycles += 6 + RET;
    s->t = 0, s->a = 0, s->r27 = 0;
    s->b = o->eb << 24 | o->b >> 8;
    s->c = 0, s->z = 1, s->n = 0, s->v = 0, s->h = 0;
}

// The larger one becomes a; b is shifted to its exponent. False: it is too small to count.
INLINE uint8_t align(floats_t *s, operands_t *o, uint8_t less) {
    if (less) {
        const operands_t was = *o;
        s->cycles += 14;
        s->r0 = o->a >> 24;
        if (s->t) s->r30 = ~s->r30 & 0xFF;
        o->a = was.b, o->ea = was.eb, o->b = was.a, o->eb = was.ea;
    } else {
        s->cycles += 3;
    }
    s->cycles += 2;
    s->r31 = 0;
    uint32_t far = o->ea - o->eb;
    o->places = (0u - far) & 0xFF;
    if (far > 32) {
        s->cycles += 6;
        return 0;
    }
    o->places = 0;
    // Bytes, each of which counts if it is not 0, then bits.
    for (; far > 7; far -= 8) {
        s->r31 -= (o->b & 0xFF) != 0;
        o->b >>= 8;
        s->cycles += 14;
    }
    s->cycles += far != 0 ? 3 + 8 * far : 2;
    s->r31 = (s->r31 - (uint32_t)translated_ones(o->b & ((1u << far) - 1))) & 0xFF;
    o->b >>= far;
    return 1;
}

INLINE void subtract(floats_t *s, operands_t *o) {
    o->a = o->a - o->b - (s->r31 != 0);
    s->cycles += 1 + 5;
    if (o->a >> 31) {
        s->cycles += 2;
        return;
    }
    s->cycles += 1;
    for (;;) {
        o->ea = (o->ea - 1) & EXPONENT;
        if (o->ea == 0) {
            s->cycles += 1 + 2 + 1;
            o->ea = 1;
            return;
        }
        o->a = o->a << 1 | s->r31 >> 7;
        s->r31 = s->r31 << 1 & 0xFF;
        s->cycles += 9;
        if (o->a >> 31) {
            s->cycles += 1;
            return;
        }
    }
}

// False: it is too large.
INLINE uint8_t add(floats_t *s, operands_t *o) {
    const uint64_t sum = (uint64_t)o->a + o->b;
    s->cycles += 2 + 4;
    o->a = (uint32_t)sum;
    if (sum >> 32 == 0) {
        s->cycles += 2;
        return 1;
    }
    if (o->ea >= 0xFE) return 0;
    s->r31 = s->r31 >> 1 | (o->a & 1) << 7;
    o->a = o->a >> 1 | SIGN;
    o->ea++;
    s->cycles += 1 + 5 + 1 + 2 + 1;
    return 1;
}

INLINE void pack(floats_t *s, const operands_t *o) {
    const uint32_t exponent = o->a >> 31 ? o->ea : 0;
    s->cycles += 3 + 3 + RET;
    s->b = o->places << 24 | o->b >> 8;
    s->r26 = o->b & 0xFF, s->r27 = o->a & 0xFF;
    s->a = s->r30 >> 7 << 31 | exponent << 23 | (o->a >> 8 & MANTISSA);
    s->h = s->r30 >> 3 & 1;
    s->r30 = s->r30 << 1 & 0xFF;
    const uint32_t last = s->a >> 16 & 0xFF;
    s->c = 0, s->z = last == 0, s->n = last >> 7, s->v = s->n;
}

// __addsf3x: a and r27, b and r26 as one number of 32 bits each. False: not computed.
INLINE uint8_t add_extended(floats_t *s, unsigned split_site, unsigned zero_site) {
    if (exponent_of(s->a) == EXPONENT || exponent_of(s->b) == EXPONENT) return 0;
    operands_t o = operands(s, split_site);
    const uint64_t a = (uint64_t)o.ea << 32 | o.a, b = (uint64_t)o.eb << 32 | o.b;
    uint8_t counts = 1;
    if (a == b) {
        s->cycles += 2;
        if (s->t) {
            cancel(s, &o, zero_site);
            return 1;
        }
    } else {
        counts = align(s, &o, a < b);
    }
    if (counts && s->t)
        subtract(s, &o);
    else if (counts && !add(s, &o))
        return 0;
    pack(s, &o);
    return 1;
}

// __fp_round.
INLINE void round_up(floats_t *s) {
    s->r0 = (uint8_t)(((s->a >> 24) + 1) << 1);
    // The highest exponents but one are looked at twice.
    s->cycles += 3 + (s->r0 != 0 ? 2 : 3) + 1;
    const uint32_t below = s->r27, up = below >> 7;
    s->cycles += RET + 2;
    add_flags(s, (uint8_t)below, (uint8_t)below, 0);
    s->r27 = (below << 1 & 0xFF) | (s->r31 & (0u - up));
    if (up && s->r27 == 0) {
        s->cycles += 3;
        if (!(s->a & 1)) {
            s->cycles += 1;
            s->z = 1, s->n = 0, s->v = 0;
            return;
        }
        s->cycles -= 2;
    }
    s->cycles += 6 * up;
    floats_t increased = *s;
    increase_flags(&increased, s->a);
    s->c = up ? increased.c : s->c, s->z = up ? increased.z : s->z;
    s->n = up ? increased.n : s->n, s->v = up ? increased.v : s->v;
    s->h = up ? increased.h : s->h;
    s->a += up;
}

// __mulsf3x. Numbers that are not normal are executed, but 0.
INLINE uint8_t multiply(floats_t *s, unsigned split_site, unsigned zero_site) {
    const uint32_t ea = exponent_of(s->a), eb = exponent_of(s->b);
    if (ea == EXPONENT || eb == EXPONENT) return 0;
    split(s, split_site);
    s->cycles += 2;
    if ((s->a & ~SIGN) == 0 || (s->b & ~SIGN) == 0) {
        // An exponent of 0 with a mantissa is that of 1.
        const uint32_t high_b = eb == 0 && (s->b & MANTISSA) != 0 ? 1 : eb;
        s->cycles += 2 + 1;
        jump(s, zero_site);
        s->cycles += 5 + RET;
        s->b = high_b << 24 | (s->b & MANTISSA) | (eb != 0 ? IMPLICIT : 0);
        s->a = (uint32_t)s->t << 31;
        s->r0 = 0, s->r27 = 0;
        s->c = 0, s->z = 1, s->n = 0, s->v = 0;
        return 1;
    }
    if (ea == 0 || eb == 0) return 0;
    const uint32_t a = (s->a & MANTISSA) | IMPLICIT, b = (s->b & MANTISSA) | IMPLICIT;
    uint64_t product = (uint64_t)a * b;
    int exponent = (int)(ea + eb) - 0x7F;
    const uint8_t goes_left = !(product >> 47);
    if (exponent <= goes_left || exponent - goes_left >= 0xFE) return 0;
    s->r0 = (uint8_t)((a >> 16) * (b >> 16));
    s->r26 = (uint8_t)(product >> 24);
    s->b = (b & 0xFF0000) | (uint32_t)(product >> 40);
    s->cycles += 4 + 50 + 2 + 2;
    product <<= goes_left;
    exponent -= goes_left;
    s->cycles += 12 * goes_left;
    s->cycles += 1 + 2 + 2 + 2 + 6 + RET;
    s->r30 = (uint8_t)product;
    s->r31 = (uint8_t)(product >> 8 | product);
    s->r27 = (uint8_t)(product >> 16);
    s->a = (uint32_t)s->t << 31 | (uint32_t)(exponent + 1) << 23 |
           ((uint32_t)(product >> 24) & MANTISSA);
    return 1;
}

// __divsf3x, of normal numbers.
INLINE uint8_t divide(floats_t *s, unsigned split_site, const unsigned turns_sites[3]) {
    const uint32_t ea = exponent_of(s->a), eb = exponent_of(s->b);
    if (!is_normal(s->a) || !is_normal(s->b)) return 0;
    const uint32_t a = (s->a & MANTISSA) | IMPLICIT, b = (s->b & MANTISSA) | IMPLICIT;
    const uint8_t goes_right = a >= b;
    const int exponent = (int)ea - (int)eb + goes_right + 0x7D;
    if (exponent < 0 || exponent >= 0xFE) return 0;
    split(s, split_site);
    s->cycles += 8 + (goes_right ? 11 : 5);
    const uint32_t divisor = b << goes_right;
    const uint64_t dividend = (uint64_t)a << 24;
    const uint32_t quotient = (uint32_t)(dividend / divisor);
    const uint32_t twice = (uint32_t)(dividend - (uint64_t)quotient * divisor) << 1;
    for (unsigned at = 0; at < 3; at++) call(s, turns_sites[at]);
    // Three times eight turns, with what is around them.
    s->cycles += 24 * 13 + 3 * translated_ones(quotient) + 3 * (1 - 1 + 1 + RET);
    s->cycles += 1 + 2 + 1 + 8 + 1 + 2 + 3 + 2 + 1 + 2 + 2 + 5 + RET;
    s->r27 = twice == divisor ? 0x80 : divisor < twice ? 0xFF : 0;
    s->r0 = (uint8_t)(quotient >> 16);
    s->r30 = (uint8_t)quotient;
    s->r31 = 0;
    s->r26 = (uint8_t)(divisor >> 24);
    s->b = divisor & 0xFFFFFF;
    s->a = (uint32_t)s->t << 31 | (uint32_t)(exponent + 1) << 23 | (quotient & MANTISSA);
    return 1;
}

// __addsf3, whose registers are here.
INLINE int64_t sum(floats_t s, translated_chip_t *chip, uint16_t sp, int64_t left) {
    enum { EXTENDED, ROUND, SPLIT, ZERO };
    if (!has_room(chip, sp, 4)) return 0;
    s.r27 = s.r26 = 0;
    s.cycles += 2;
    call(&s, EXTENDED);
    if (!add_extended(&s, SPLIT, ZERO)) return 0;
    jump(&s, ROUND);
    round_up(&s);
    if (s.cycles >= left) return 0;
    leave_return(chip->data, sp, s.sites[EXTENDED]);
    leave_return(chip->data, sp - 2, s.sites[SPLIT]);
    return given(chip, &s);
}

int64_t translated_addsf3(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    return sum(taken(chip, sites), chip, sp, left);
}

int64_t translated_subsf3(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    floats_t s = taken(chip, sites);
    s.b ^= SIGN;
    s.cycles = 1;
    return sum(s, chip, sp, left);
}

int64_t translated_addsf3x(translated_chip_t *chip, uint16_t sp, int64_t left,
                           const uint16_t *sites) {
    enum { SPLIT, ZERO };
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, 2) || !add_extended(&s, SPLIT, ZERO) || s.cycles >= left) return 0;
    leave_return(chip->data, sp, sites[SPLIT]);
    return given(chip, &s);
}

// __mulsf3, whose sites have these numbers.
typedef struct {
    uint8_t extended, round, split, zero;
} product_sites_t;

INLINE uint8_t product(floats_t *s, const product_sites_t *at) {
    call(s, at->extended);
    if (!multiply(s, at->split, at->zero)) return 0;
    jump(s, at->round);
    round_up(s);
    return 1;
}

int64_t translated_mulsf3(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    static const product_sites_t AT = {.extended = 0, .round = 1, .split = 2, .zero = 8};
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, 4) || !product(&s, &AT) || s.cycles >= left) return 0;
    leave_return(chip->data, sp, sites[AT.extended]);
    leave_return(chip->data, sp - 2, sites[AT.split]);
    return given(chip, &s);
}

int64_t translated_divsf3(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    enum { EXTENDED, ROUND, SPLIT };
    static const unsigned TURNS_OF[] = {3, 5, 6};
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, 4)) return 0;
    call(&s, EXTENDED);
    if (!divide(&s, SPLIT, TURNS_OF)) return 0;
    jump(&s, ROUND);
    round_up(&s);
    if (s.cycles >= left) return 0;
    leave_return(chip->data, sp, sites[EXTENDED]);
    leave_return(chip->data, sp - 2, sites[TURNS_OF[2]]);
    return given(chip, &s);
}

// __cmpsf2 and __gesf2: __fp_cmp of two numbers.
int64_t translated_compare(translated_chip_t *chip, uint16_t sp, int64_t left,
                           const uint16_t *sites) {
    enum { INFINITE = 0xFF000000 };
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, 2)) return 0;
    const uint8_t is_negative_a = is_negative(s.a), is_negative_b = is_negative(s.b);
    const uint32_t high_a = (s.a & 0x7F000000) << 1, high_b = (s.b & 0x7F000000) << 1;
    // Only the highest bytes are shifted.
    const uint32_t a = high_a | (s.a & 0xFFFFFF), b = high_b | (s.b & 0xFFFFFF);
    if (exponent_of(s.a) == EXPONENT || exponent_of(s.b) == EXPONENT) return 0;
    call(&s, 0);
    s.cycles += 6 + 5 + 5 + 4;
    const uint32_t rest = a - b;
    const uint8_t is_same_sign = is_negative_a == is_negative_b, less = a < b;
    s.r30 = 0x80, s.r31 = 0xFE;
    s.r0 = is_same_sign ? 0 : 0xFF;
    s.r26 = is_negative_b ? 0xFF : 0;
    s.h = (uint8_t)((a >> 24 ^ b >> 24 ^ rest >> 24) >> 4 & 1);
    s.t = chip->flags[6];
    uint8_t result = 0;
    uint32_t bytes = b;
    uint8_t is_over = 0;
    if (rest == 0) {
        s.cycles += 1 + 1;
        if (is_same_sign) {
            s.cycles += 2;
            s.c = 0, s.z = 1, s.n = 0, s.v = 0;
            is_over = 1;
        } else {
            const uint8_t any = (uint8_t)(b | b >> 8 | b >> 16 | b >> 24);
            bytes = (b & 0xFFFFFF00) | any;
            s.cycles += 1 + 3;
            if (any == 0) {
                s.cycles += 1;
                s.c = 0, s.z = 1, s.n = 0, s.v = 0;
                is_over = 1;
            } else {
                s.cycles += 2;
            }
        }
    } else {
        s.cycles += 2 + 1 + 2;
        if (is_same_sign) s.r26 = (uint8_t)(s.r26 - 1 - less);
    }
    if (!is_over) {
        const uint8_t carry = s.r26 & 1, middle = (uint8_t)(0xFF + carry);
        s.r26 >>= 1;
        result = (uint8_t)(middle + carry);
        add_flags(&s, middle, 0, carry);
        s.cycles += 4;
    }
    s.cycles += RET;
    s.a = (rest & 0xFF00FFFF) | (uint32_t)result << 16;
    s.b = bytes;
    s.cycles += 2 + RET;
    if (s.cycles >= left) return 0;
    leave_return(chip->data, sp, sites[0]);
    return given(chip, &s);
}

// __fp_powser: Horner's scheme, with coefficients in flash behind their number.
typedef struct {
    uint8_t skip, add, multiply, add_split, add_zero, multiply_split, multiply_zero;
} series_sites_t;

enum { COEFFICIENT_BYTES = 5, SERIES_PUSHES = 7 };

INLINE uint8_t series(floats_t *s, const uint8_t *flash, const series_sites_t *at) {
    unsigned from = s->r30 | s->r31 << 8;
    const uint32_t x = s->a;
    if (from >= 0x7000) return 0;
    unsigned turns = flash[from];
    if (turns == 0 || turns > 32) return 0;
    s->b = number_at(flash + from + 1);
    from += COEFFICIENT_BYTES;
    s->cycles += 2 * SERIES_PUSHES + 2 + 1;
    jump(s, at->skip);
    s->cycles += 3 * COEFFICIENT_BYTES + 2 + 1;
    s->r26 = (uint8_t)turns;
    for (;; turns--) {
        s->cycles += 1;
        s->r30 = (uint8_t)from, s->r31 = (uint8_t)(from >> 8);
        call(s, at->multiply);
        if (!multiply(s, at->multiply_split, at->multiply_zero)) return 0;
        s->cycles += 2 + 3 * COEFFICIENT_BYTES + 1 + 1;
        s->r26 = flash[from];
        s->b = number_at(flash + from + 1);
        from += COEFFICIENT_BYTES;
        s->r30 = (uint8_t)from, s->r31 = (uint8_t)(from >> 8);
        call(s, at->add);
        if (!add_extended(s, at->add_split, at->add_zero)) return 0;
        s->b = x;
        s->cycles += 3 + 1;
        if (turns == 1) break;
        s->cycles += 2;
    }
    s->cycles += 1 + 2 * SERIES_PUSHES + RET;
    s->r30 = (uint8_t)from, s->r31 = (uint8_t)(from >> 8);
    s->z = 1, s->n = 0, s->v = 0;
    return 1;
}

// Bytes that it leaves below the stack pointer.
static void leave_series(uint8_t *data, uint16_t sp, const uint16_t *sites,
                         const series_sites_t *at) {
    static const uint8_t PUSHED[SERIES_PUSHES] = {29, 28, 17, 16, 15, 14, 13};
    for (unsigned i = 0; i < SERIES_PUSHES; i++) data[sp--] = data[PUSHED[i]];
    leave_return(data, sp, sites[at->add]);
    leave_return(data, sp - 2, sites[at->add_split]);
}

int64_t translated_powser(translated_chip_t *chip, uint16_t sp, int64_t left,
                          const uint16_t *sites) {
    static const series_sites_t AT = {.skip = 0,
                                      .add = 1,
                                      .multiply = 2,
                                      .add_split = 3,
                                      .add_zero = 4,
                                      .multiply_split = 5,
                                      .multiply_zero = 15};
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, PUSHES) || !series(&s, chip->flash, &AT) || s.cycles >= left) return 0;
    leave_series(chip->data, sp, sites, &AT);
    return given(chip, &s);
}

// __fp_powsodd: x times a series of its square.
int64_t translated_powsodd(translated_chip_t *chip, uint16_t sp, int64_t left,
                           const uint16_t *sites) {
    enum { SQUARE, SERIES, TIMES };
    static const product_sites_t PRODUCT = {.extended = 3, .round = 4, .split = 6, .zero = 13};
    static const series_sites_t AT = {.skip = 5,
                                      .add = 9,
                                      .multiply = 14,
                                      .add_split = 15,
                                      .add_zero = 16,
                                      .multiply_split = 6,
                                      .multiply_zero = 13};
    floats_t s = taken(chip, sites);
    if (!has_room(chip, sp, PUSHES)) return 0;
    const uint32_t x = s.a;
    const uint32_t low = s.r30, high = s.r31;
    s.b = x;
    s.cycles = 12 + 2;
    call(&s, SQUARE);
    if (!product(&s, &PRODUCT)) return 0;
    s.r30 = low, s.r31 = high;
    s.cycles += 4;
    call(&s, SERIES);
    if (!series(&s, chip->flash, &AT)) return 0;
    s.b = x;
    s.cycles += 8;
    jump(&s, TIMES);
    if (!product(&s, &PRODUCT) || s.cycles >= left) return 0;
    leave_return(chip->data, sp - 4, sites[SERIES]);
    leave_series(chip->data, sp - 6, sites, &AT);
    leave_return(chip->data, sp, sites[PRODUCT.extended]);
    leave_return(chip->data, sp - 2, sites[PRODUCT.split]);
    return given(chip, &s);
}
