/// Passes of a guest's loops: what the engine and translated code (translated/code.h) note of one
/// when it begins, and how they know that all passes up to the next interrupt will do the same.
///
/// A pass that has left registers, flags and SRAM as they were repeats. A variable may have been
/// another one meanwhile, as a lock or a sum that begins anew: what stores change is added up, and
/// comes to nothing. A function's locals are no sum, since what lies below the main loop's stack is
/// many functions' in turn, whose pushes are not looked at: a program reads what it has pushed
/// itself. These bytes are compared as the whole pass has left them.
///
/// Passes may also come back in turns, as of a program that goes to and fro between two states. So
/// where one differs from the one before, the next ones are compared with that too, 1 of them, then
/// 2 and 4, MOST_COMPARED: Brent's way to find a cycle. All that is said here of a pass is true of
/// so many of them, one after the other.
///
/// A pass in which the LED has another colour meanwhile repeats, but not beyond the end of a run,
/// where others may look at it (SHOWN).
///
/// A pass whose stores come to something may still repeat if that is a counter's: as the code of a
/// program without counters, which is most, has none of it, that is apart (passes/counters.h).
///
/// A pass that has been interrupted counts as one that changes something, so that the one behind it
/// is the first that may be known to repeat, and is executed to know it. docs/passes.md, 1.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PASSES_PASS_H
#define KILOTWIN_ROBOTS_TRANSLATED_PASSES_PASS_H

#include <stdint.h>
#include <string.h>

/// Where a pass begins, and the state at that moment but for SRAM.
typedef struct {
    uint8_t registers[0x20];  ///< r0 to r31; of the main loop's those that functions keep
    uint32_t pc;              ///< byte address
    uint16_t stack;           ///< pointer: the next free byte
    uint8_t status;           ///< the status register
    uint64_t below;           ///< translated_below() of the stack below its pointer; 0: not known
    uint8_t span;             ///< so many passes behind it are compared with it
    uint8_t compares;         ///< so many of them are left
    uint8_t counted[16];      ///< bytes of the program's counters, one after the other
} translated_pass_t;

/// Bytes of the stack below a pass's pointer that are compared: locals and what interrupts leave.
/// A store farther down counts as one of a variable's.
enum { BELOW = 128 };

/// A number that tells those bytes from others, by 64 bits; 0: they are not all in SRAM. A copy of
/// them would cost each robot as many bytes.
static inline uint64_t translated_below(const uint8_t *data, uint16_t stack) {
    if (stack < 0x100 + BELOW || stack >= 0x900) return 0;
    uint64_t sum = stack;
    for (const uint8_t *at = data + stack - BELOW + 1; at <= data + stack; at += sizeof sum) {
        uint64_t word;
        memcpy(&word, at, sizeof word);
        sum = (sum ^ word) * 0x9E3779B97F4A7C15;
        sum ^= sum >> 32;
    }
    return sum | 1;
}

/// Changes of a pass that do not go back: effects on peripherals, and the stack by a function
/// that has returned behind where the pass stands; those of bytes that translated_below() tells
/// apart; and what a pass does with a counter that a repeated one might do otherwise.
enum { CHANGED = 1, CHANGED_BELOW = 2, NOT_COUNTED = 4 };
/// Beside these: it has held interrupts back for more than MOST_HELD cycles at once, so that edges
/// of light may be lost in it. Up to so many none is: it waits so long, and then for another edge's
/// interrupt at most.
enum { HELD = 8, MOST_HELD = 64 };
/// The LED has shown another colour.
enum { SHOWN = 16 };
/// A pass that the next ones are compared with stays that for so many of them at most.
enum { MOST_COMPARED = 4 };

/// The weight of a byte in SRAM: an odd number that has little to do with that of the next byte.
/// The sum of weights times differences is 0 if the bytes are as they were; it is not if one has
/// changed, and of several in one case of 2^64.
static inline uint64_t translated_weight(uint16_t address) {
    uint64_t weight = (address + 1u) * 0x9E3779B97F4A7C15;
    weight ^= weight >> 32;
    return weight * 0xD6E8FEB86659FD93 | 1;
}

/// Jumps backwards from one CHECKPOINT to the next.
enum { TURNS = 256 };
/// In place of a pass's cycles: a pass of the main loop begins that may be a known one.
enum { TO_RECALL = -1 };

/// Whether a pass has left all but registers as it found it: `changed` and `net` as in
/// translated_chip_t, and translated_below() of where it ends, or 0 if that has not changed.
static inline uint8_t translated_kept(const translated_pass_t *pass, uint8_t changed, uint64_t net,
                                      uint64_t below) {
    if (net != 0 || (changed & CHANGED) != 0) return 0;
    return (changed & CHANGED_BELOW) == 0 || (below != 0 && below == pass->below);
}

/// A pass begins that the next ones are compared with: more of them than with the one before, if
/// that was compared with passes of the same loop in vain.
static inline void translated_compare_more(translated_pass_t *pass, uint8_t in_vain) {
    const int span = in_vain ? 2 * pass->span : 1;
    pass->span = (uint8_t)(span < MOST_COMPARED ? span : MOST_COMPARED);
    pass->compares = (uint8_t)(pass->span - 1);
}

#ifdef MAIN_REGION
/// Behind the blocks of the region that a guest is mostly in: `pass` and `attend`, to which macros
/// of translated/code.h jump. Of passes that repeat only the last one is executed, in which the
/// interrupt comes. `differing` is 0 if the registers are those of chip->pass, `note` copies them
/// there. The main loop, of whose addresses `in_main` is true, calls functions in each pass, so
/// that where one begins nothing is in the registers that they may change, nor in the flags but T
/// and I: elsewhere those are looked at too, by `scratch_differing` and `note_scratch`.
///
/// `attend` hands the engine what it needs of the state and takes it back. The engine may have
/// served interrupts or ended one, so that the program goes on elsewhere.
#define MAIN_REGION_ENDS(in_main, differing, note, scratch_differing, note_scratch)                \
    pass : {                                                                                       \
        translated_pass_t *const pass_ = chip->pass;                                               \
        const uint8_t main_ = (in_main);                                                           \
        chip->passed |= main_;                                                                     \
        const uint8_t status_ = main_ ? (uint8_t)(tf << 6 | inf << 7) : SREG;                      \
        const uint64_t below_ = changed & CHANGED_BELOW ? translated_below(M, sp) : 0;             \
        const uint64_t added_ = ADDED(main_);                                                      \
        const uint8_t here_ = pass_->pc == pc && pass_->stack == sp;                               \
        if (!chip->executes && translated_kept(pass_, changed, net - added_, below_) && here_ &&   \
            pass_->status == status_ && (differing) == 0 && (main_ || (scratch_differing) == 0)) { \
            const int64_t took_ = chip->pass_left - left;                                          \
            if (added_ != 0) {                                                                     \
                COUNT_ON(took_);                                                                   \
                NOTE_COUNTERS;                                                                     \
                chip->turns = TURNS, changed &= SHOWN, net = 0;                                    \
            } else if (!chip->repeats && (changed & SHOWN) == 0) {                                 \
                chip->pass_cycles = took_;                                                         \
                STOP(pc, 0, CHECKPOINT);                                                           \
            } else if (left > 0) {                                                                 \
                left = (int64_t)((uint64_t)left % (uint64_t)took_);                                \
            }                                                                                      \
            if ((changed & SHOWN) != 0) {                                                          \
                chip->left = left;                                                                 \
                chip->pin_written(chip, 0);                                                        \
            }                                                                                      \
        } else if (here_ && pass_->compares > 0 && (changed & CHANGED) == 0) {                     \
            pass_->compares--, chip->turns = TURNS;                                                \
            goto dispatch;                                                                         \
        } else {                                                                                   \
            translated_compare_more(pass_, here_ && (changed & CHANGED) == 0);                     \
            pass_->pc = pc, pass_->stack = top = sp, pass_->status = status_;                      \
            note;                                                                                  \
            if (!main_) {                                                                          \
                note_scratch;                                                                      \
            }                                                                                      \
            NOTE_COUNTERS;                                                                         \
            pass_->below = below_, chip->turns = TURNS, changed = 0, net = 0;                      \
            if (main_ && --chip->recalls_in <= 0) {                                                \
                chip->pass_left = left, chip->pass_cycles = TO_RECALL;                             \
                STOP(pc, 0, CHECKPOINT);                                                           \
            }                                                                                      \
        }                                                                                          \
        chip->pass_left = left;                                                                    \
        goto dispatch;                                                                             \
    }                                                                                              \
    attend:                                                                                        \
    chip->left = left, chip->pc = pc, chip->changed = changed;                                     \
    M[0x5D] = (uint8_t)sp, M[0x5E] = (uint8_t)(sp >> 8), F[7] = (uint8_t)inf;                      \
    M[24] = r24, M[25] = r25;                                                                      \
    {                                                                                              \
        const uint8_t goes_on_ = chip->attend(chip, attended);                                     \
        left = chip->left, pc = chip->pc, changed = chip->changed;                                 \
        sp = (uint16_t)(M[0x5D] | M[0x5E] << 8), inf = F[7], r24 = M[24], r25 = M[25];             \
        if (!goes_on_) STOP(pc, 0, ATTENDED);                                                      \
    }                                                                                              \
    goto dispatch;
#else
#define MAIN_REGION_ENDS(in_main, differing, note, scratch_differing, note_scratch)
#endif

#endif
