/// Passes of the main loop that change nothing but counters, for speed alone (docs/passes.md, 2).
///
/// A counter is a variable that the program adds to and compares with constants, but for accesses
/// that are NOT_COUNTED (host_tools/kilotwin/build/avr_counters.py finds them). A pass that changes
/// nothing else adds the same number when it comes again, and goes the same way until a counter
/// crosses a bound; so many passes are left out by a multiplication. In such a pass each counter is
/// stored once at most, and no pointer reads it.
///
/// Why that is so: let all but counters be the same where a pass begins and where it ends. Code
/// sees of a counter what its branches ask for, and adds to it numbers that come from elsewhere. So
/// if each branch is taken as before the next pass executes the same instructions in the same
/// cycles, adds the same numbers, and ends with all else as it was: the condition for the next
/// again. An interrupt may change anything, so that passes go on up to it and no farther.
///
/// The plain twin is each pass executed, by `executes` of translated_chip_t
/// (tests/translation/test_known_passes.py).
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PASSES_COUNTERS_H
#define KILOTWIN_ROBOTS_TRANSLATED_PASSES_COUNTERS_H

#include <stdint.h>

#include "robots/translated/passes/pass.h"

/// A number in data space, the lowest byte first.
typedef struct {
    uint16_t address;  ///< of the lowest byte
    uint8_t bytes;     ///< 1, 2 or 4
} translated_counter_t;

/// A number at which a branch may go another way: something that code asks of a counter, modulo
/// 2^bits, comes out otherwise from `at` - 1 to `at`.
///
/// n == 1000 has the bounds 1000 and 1001, n < 500 has 500 and 0, where n begins anew. A test of
/// bit 5 is one of n modulo 64, with the bounds 32 and 0.
typedef struct {
    uint8_t counter;  ///< number, as in translated_counters_t
    uint8_t bits;     ///< 1 to 32
    uint32_t at;      ///< less than 2^bits
} translated_bound_t;

/// Those of a program, and all their bounds.
typedef struct {
    unsigned count;                        ///< of counters
    const translated_counter_t *counters;  ///< by address
    unsigned bounds_count;                 ///< of all counters
    const translated_bound_t *bounds;
} translated_counters_t;

/// The value of a counter whose bytes are these.
static inline uint32_t translated_number(const uint8_t *bytes, unsigned count) {
    uint32_t number = 0;
    for (unsigned at = 0; at < count; at++) number |= (uint32_t)bytes[at] << 8 * at;
    return number;
}

/// The sum of what the pass has added to counters, as it is in `net` of translated_chip_t: weights
/// times differences of bytes. If that is all of `net`, nothing else in SRAM has changed. It is
/// taken from the bytes themselves, so that a stack that reaches down to a counter shows.
static inline uint64_t translated_added(const translated_counters_t *all, const uint8_t *data,
                                        const translated_pass_t *pass) {
    uint64_t net = 0;
    const uint8_t *was = pass->counted;
    for (unsigned i = 0; i < all->count; i++)
        for (unsigned at = 0; at < all->counters[i].bytes; at++, was++) {
            const uint16_t address = (uint16_t)(all->counters[i].address + at);
            net += translated_weight(address) * ((uint64_t)data[address] - *was);
        }
    return net;
}

/// How many passes more go the same way as the one between these two values of a counter: it may
/// ask for it before it adds to it and behind that. So all of these values, from `was` on, and one
/// more have to lie on the same side. Steps of more than half of 2^bits go down. UINT64_MAX: what
/// is asked does not move.
static inline uint64_t translated_room(const translated_bound_t *bound, uint32_t was,
                                       uint32_t now) {
    const uint64_t all = (uint64_t)1 << bound->bits;
    const uint64_t step = (now - was) & (all - 1);
    if (step == 0) return UINT64_MAX;
    const uint8_t goes_up = step <= all / 2;
    const uint64_t far = (goes_up ? bound->at - was - 1 : was - bound->at) & (all - 1);
    const uint64_t steps = far / (goes_up ? step : all - step);
    return steps > 1 ? steps - 1 : 0;
}

/// Repeats the pass that has just ended, at most so many times: all counters go on by as many
/// steps, each by its own, and the first that has no room ends it. How many times that was.
static inline uint64_t translated_count_on(const translated_counters_t *all, uint8_t *data,
                                           const translated_pass_t *pass, uint64_t most) {
    uint32_t was[sizeof pass->counted], now[sizeof pass->counted];
    const uint8_t *before = pass->counted;
    for (unsigned i = 0; i < all->count; before += all->counters[i++].bytes) {
        was[i] = translated_number(before, all->counters[i].bytes);
        now[i] = translated_number(data + all->counters[i].address, all->counters[i].bytes);
    }
    for (unsigned i = 0; i < all->bounds_count; i++) {
        const translated_bound_t *bound = &all->bounds[i];
        const uint64_t room = translated_room(bound, was[bound->counter], now[bound->counter]);
        if (room < most) most = room;
    }
    for (unsigned i = 0; i < all->count; i++) {
        const uint32_t number = now[i] + (now[i] - was[i]) * (uint32_t)most;
        for (unsigned at = 0; at < all->counters[i].bytes; at++)
            data[all->counters[i].address + at] = (uint8_t)(number >> 8 * at);
    }
    return most;
}

/// Where a pass begins: what its stores and its end are compared with.
/// `counted` of the pass takes the bytes of all counters, in their order.
static inline void translated_note_counters(const translated_counters_t *all, const uint8_t *data,
                                            translated_pass_t *pass) {
    uint8_t *to = pass->counted;
    for (unsigned i = 0; i < all->count; i++)
        for (unsigned at = 0; at < all->counters[i].bytes; at++)
            *to++ = data[all->counters[i].address + at];
}

/// Macros of a program with counters; elsewhere they cost nothing.
#ifdef COUNTERS
/// By address of data space: NOT_COUNTED if the byte is a counter's, or 0.
extern const uint8_t is_counted[];
/// Before a store that adds to a counter, of which byte `place` of the pass's `counted` is that
/// byte: if it is another one by now, the pass has stored it before.
#define COUNT(address, place) \
    changed |= (uint8_t)((M[address] != chip->pass->counted[place]) * NOT_COUNTED)
/// A load by a pointer, which should not lead to a counter, but may.
#define READ_COUNTED(address) changed |= is_counted[address]
/// The part of a pass's `net` that is counters'; 0 if it may not be repeated for them.
#define ADDED(main)                                                 \
    ((main) && net != 0 && (changed & (CHANGED | NOT_COUNTED)) == 0 \
         ? translated_added(&counted, M, pass_)                     \
         : 0)
/// Leaves passes out that take so many cycles each, as far as `left` goes.
#define COUNT_ON(took)                                                            \
    do {                                                                          \
        const uint64_t most_ = left > 0 ? (uint64_t)(left / (took)) : 0;          \
        left -= (int64_t)translated_count_on(&counted, M, pass_, most_) * (took); \
        NOTE_COUNTED(&counted);                                                   \
    } while (0)
/// A pass begins.
#define NOTE_COUNTERS translated_note_counters(&counted, M, pass_)
#else
#define READ_COUNTED(address) (void)0
#define ADDED(main) 0
#define COUNT_ON(took) (void)0
#define NOTE_COUNTERS (void)0
#endif

#endif
