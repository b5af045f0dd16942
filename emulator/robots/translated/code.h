/// Language of the C code made from a chip's machine code: one macro for each instruction, and
/// the table by which the emulator finds the code. host_tools/kilotwin/build/translator.py writes
/// it; avr/chip/translated_core.h runs it on a chip, robots/translated/robot.h as a guest.
///
/// The code is cut into regions, a function each. A region is entered at the begin of one of its
/// blocks and goes on until it leaves its region, until the cycles that it may use are spent, or
/// until an instruction has an effect outside of registers, flags, SRAM and registers that are
/// plain memory; that instruction it leaves to the interpreter. Within a region registers and flags
/// are locals; M is the data space.
///
/// Code of a guest (TRANSLATED_GUEST) differs where the engine plays the peripherals: a block is
/// executed as a whole once it has begun within the cycles that are left, jumps backwards and the
/// main loop's passes are checkpoints, at which the engine looks whether anything has changed, and
/// functions of the runtime that are the engine's are not executed but reported. One region of it,
/// the main one, has the main loop, the program's functions and the tick's interrupt. A thousand
/// robots that walk spend nearly all of their time there, and entering and leaving it, with 32
/// registers to load and to store, would take as long as a pass of loop(). So all of these things
/// happen without leaving it, by a call of the engine that has only what that needs of the state.
///
/// Flags are kept as what they follow from: Z is set if zr is 0, N, V and S are bit 7 of nr, vr and
/// sr, H is bit 4 of hr; cf, tf and inf are C, T and I, 0 or 1.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_CODE_H
#define KILOTWIN_ROBOTS_TRANSLATED_CODE_H

#include <stdint.h>

#include "robots/translated/coverage.h"
#include "robots/translated/passes/counters.h"
#include "robots/translated/passes/loops.h"
#include "robots/translated/passes/pass.h"
#include "robots/translated/routines/routines.h"
#include "robots/translated/stack_code.h"
#include "robots/translated/watched.h"

/// Changes with every change of the two structures; the emulator takes no other.
#define TRANSLATION_VERSION 13

/// State of a chip, for the time of a call.
typedef struct translated_chip {
    uint8_t *data;           ///< data space: registers, I/O, SRAM, 0x900 bytes
    uint8_t *flags;          ///< C Z N V S H T I, 0 or 1 each
    const uint8_t *flash;    ///< 32 KB as the program can read them now
    const uint8_t *effects;  ///< by data address below 0x100: READ_EFFECT, WRITE_EFFECT
    int64_t left;            ///< cycles: an instruction begins only while this is above 0
    uint32_t pc;             ///< byte address of the next instruction
    int32_t turns;           ///< of a guest: jumps backwards until the next CHECKPOINT
    uint8_t changed;         ///< of a guest: CHANGED bits of the pass that goes on
    uint8_t awaits;          ///< of a guest: `left` counts to the next interrupt, as interrupts are
                             ///< let through; they may be held back and let through on the way
    uint8_t calls;           ///< of a guest: which functions are the engine's, bits by CALL_
    uint8_t passed;          ///< of a guest: set by passes of the main loop, and within delay()
    int64_t held;            ///< of a guest: `left` when interrupts were last held back
    // Passes of a guest's loops.
    uint8_t repeats;          ///< `left` counts to an interrupt, not to the end of a run
    uint8_t executes;         ///< each pass, also those that change nothing: for tests
    uint64_t net;             ///< translated_weight() of what it has changed so far of SRAM, but
                              ///< for CHANGED_BELOW: 0 if all is as it was
    translated_pass_t *pass;  ///< the one that has begun last
    int64_t pass_left;        ///< `left` when that was
    int64_t pass_cycles;      ///< with CHECKPOINT: passes from here on change nothing and take so
                              ///< long; 0: not known, TO_RECALL
    int32_t recalls_in;       ///< passes of the main loop until the next TO_RECALL
    /// Lets the engine act in the midst of a region. The program counter, the stack pointer, I,
    /// r24, r25, `left` and `changed` are in the state meanwhile; all may have changed afterwards.
    /// False: the region has to be left.
    uint8_t (*attend)(struct translated_chip *chip, unsigned what);
    /// A register with PIN_EFFECT has got another value; `left` is that of the instruction's begin.
    /// Bits for `changed`.
    uint8_t (*pin_written)(struct translated_chip *chip, uint16_t address);
    /// A division by zero begins. The program counter and the stack pointer are here meanwhile.
    void (*divides_by_zero)(struct translated_chip *chip);
    /// A watched translation stores another byte; pc, stack and `left` are the instruction's.
    void (*stores)(struct translated_chip *chip, uint16_t address, uint8_t value);
    uint16_t pushed_from;  ///< likewise: the lowest address that has been pushed to
    /// The jump, in such a translation, by which a function has gone on in another one, which
    /// returns in its place; 0: none since the last call or return.
    uint32_t jumped;
    /// DEBUGGED code reports that an instruction begins: all of the state is here, and is not to be
    /// changed. Bits for `changed`.
    uint8_t (*instruction_begins)(struct translated_chip *chip);
    uint8_t turns_wanted;                  ///< likewise: no turn of an inner loop is left out
    const translated_routine_t *routines;  ///< that are computed; null: all are executed
    uint32_t numbers[4];                   ///< registers of a routine (ROUTINE)
} translated_chip_t;

/// An access to this register does more than reading or writing a byte; CHANGE_EFFECT, of guests: a
/// write of another value does; PIN_EFFECT: that shows, and changes nothing of what comes next.
enum { READ_EFFECT = 1, WRITE_EFFECT = 2, CHANGE_EFFECT = 4, PIN_EFFECT = 8 };

/// Why a region has come to an end.
typedef enum {
    GO_ON,           ///< what is at pc is another region's
    INTERPRET_ONE,   ///< the instruction at pc is the interpreter's
    INTERPRET_REST,  ///< from pc on cycles do not suffice for a block
    CHECKPOINT,      ///< of a guest: a loop begins anew at pc
    CALL_ENGINE,     ///< of a guest: the function at pc is the engine's
    ATTENDED         ///< of a guest: by translated_chip_t.attend()
} translated_end_t;

typedef translated_end_t (*translated_region_t)(translated_chip_t *chip);

/// Functions of a robot's runtime that the engine carries out for a guest.
enum {
    CALL_SEND,       ///< kilolib_infrared_send()
    CALL_RECEIVING,  ///< kilolib_infrared_receiving()
    CALL_BEGAN,      ///< kilolib_infrared_frame_began()
    CALL_CONVERT,    ///< kilolib_converter_read()
    CALL_DISTANCE,   ///< estimate_distance()
    ENGINE_CALLS
};

/// Other things that translated_chip_t.attend() is for, behind these functions.
enum {
    NO_CYCLES = ENGINE_CALLS,  ///< are left for the block at pc
    END_OF_INTERRUPT           ///< by the instruction at pc
};

/// Where the engine meets a guest: byte addresses in flash, and of variables in SRAM. 0: the
/// program has none.
typedef struct {
    uint16_t calls[ENGINE_CALLS];  ///< functions that end in CALL_ENGINE
    uint16_t obey;                 ///< kilolib_command_obey()
    uint16_t robot, heard;         ///< robot_core_t, robot_heard_t
    uint16_t ticks, tx_period;     ///< kilo_ticks, kilo_tx_period
    uint16_t message, distance;    ///< of the receiver, for the program's callback
    uint16_t message_rx;           ///< kilo_message_rx
    uint16_t variables_end;        ///< behind the last one
    uint8_t names_period;          ///< the program has to do with kilo_tx_period itself
    uint8_t original;              ///< its runtime has the traits of the published one
} translated_seam_t;

/// An image and all its regions, which a shared object exports as `translation`.
typedef struct {
    uint32_t version;                 ///< TRANSLATION_VERSION
    uint32_t regions;                 ///< how many
    const translated_region_t *code;  ///< by number of the region
    const uint16_t (*extent)[2];      ///< byte addresses: the first, one behind the last
    const uint16_t *region_of;        ///< by word address: 1 + number if it may be entered there
    const uint8_t *flash;             ///< the 32 KB that the code was made from
    uint32_t eeprom_bytes;            ///< how many bytes of the EEPROM come with it
    const uint16_t (*eeprom)[2];      ///< address and byte
    const translated_seam_t *seam;    ///< of a guest; null: of a whole chip
} translation_t;

// Macros from here on are for regions alone. Such a function is
//
//   a switch that goes to the block at pc,
//   blocks, each of them: BLOCK, instructions, and a jump to another block or a STOP,
//   the label `out`, behind which registers and flags go back.
//
// Cycles are counted where a block is left, by a constant for each way out of it. A block is
// entered only if all its instructions begin within the cycles that are left, so that the
// interpreter stops at the same instruction. Work for a flag that is set anew before it is read,
// the compiler leaves out.
#ifdef TRANSLATED_CODE

/// A pass of a guest's loop finds what lies on the stack above `top` when it begins. A function
/// that returns farther than that has changed it, since another may call it the next time.
#ifdef TRANSLATED_GUEST
#define PASS_TOP uint16_t top = chip->pass->stack
#define RETURNED changed |= sp > top;
#else
#define PASS_TOP (void)0
#define RETURNED
#endif
/// At a region's begin: flags and the stack pointer become locals, which the compiler keeps in this
/// computer's registers. Registers follow, those that the region uses; others stay where they are.
#define ENTER                                                                 \
    uint8_t *const M = chip->data;                                            \
    uint8_t *const F = chip->flags;                                           \
    const uint8_t *const flash = chip->flash;                                 \
    const uint8_t *const effects = chip->effects;                             \
    translated_end_t end = GO_ON;                                             \
    int64_t left = chip->left;                                                \
    uint32_t pc = chip->pc;                                                   \
    uint16_t sp = (uint16_t)(M[0x5D] | M[0x5E] << 8);                         \
    unsigned cf = F[0], tf = F[6], inf = F[7];                                \
    uint8_t zr = !F[1], nr = (uint8_t)(F[2] << 7), vr = (uint8_t)(F[3] << 7), \
            sr = (uint8_t)(F[4] << 7), hr = (uint8_t)(F[5] << 4);             \
    uint8_t changed = chip->changed;                                          \
    uint64_t net = chip->net;                                                 \
    unsigned attended = 0;                                                    \
    PASS_TOP;                                                                 \
    (void)flash, (void)effects, (void)attended;

/// At its end they go back.
#define LEAVE                                                                           \
    M[0x5D] = (uint8_t)sp, M[0x5E] = (uint8_t)(sp >> 8);                                \
    F[0] = (uint8_t)cf, F[1] = zr == 0, F[2] = nr >> 7, F[3] = vr >> 7, F[4] = sr >> 7; \
    F[5] = hr >> 4 & 1, F[6] = (uint8_t)tf, F[7] = (uint8_t)inf;                        \
    chip->left = left, chip->pc = pc, chip->changed = changed, chip->net = net;         \
    return end;

/// Whether turns may be left out where passes/loops.h has a loop.
#define LEAPS (!chip->executes && !chip->turns_wanted)
/// Stands before each instruction of code whose robot a debugger holds. That code keeps registers
/// where they are, in M.
#define INSTRUCTION(at, offset)                                                             \
    do {                                                                                    \
        M[0x5D] = (uint8_t)sp, M[0x5E] = (uint8_t)(sp >> 8);                                \
        F[0] = (uint8_t)cf, F[1] = zr == 0, F[2] = nr >> 7, F[3] = vr >> 7, F[4] = sr >> 7; \
        F[5] = hr >> 4 & 1, F[6] = (uint8_t)tf, F[7] = (uint8_t)inf;                        \
        chip->left = left - (offset), chip->pc = (at);                                      \
        changed |= chip->instruction_begins(chip);                                          \
    } while (0);

/// Leaves the region with `at` as the next instruction, `spent` cycles after the block's begin: all
/// that comes before it in the block has been done.
#define STOP(at, spent, why)                     \
    do {                                         \
        left -= (spent), pc = (at), end = (why); \
        goto out;                                \
    } while (0)
/// Goes to an address that only the chip knows. A guest's program is one region, mostly, and what
/// is not in it is another's; a chip leaves the region.
#ifdef TRANSLATED_GUEST
#define NOT_HERE GO_ON
#define DISPATCH \
    dispatch:
#define GO_TO(to, spent)            \
    do {                            \
        left -= (spent), pc = (to); \
        goto dispatch;              \
    } while (0)
#else
#define NOT_HERE INTERPRET_ONE
#define DISPATCH
#define GO_TO(to, spent) STOP(to, spent, GO_ON)
#endif
/// An instruction `at` that is `offset` cycles into its block is not for this code.
#define HAND_OVER(at, offset) STOP(at, offset, INTERPRET_ONE)
/// A block, of which the last instruction begins `last` cycles after the first. A guest's, behind
/// an instruction that lets interrupts through, is begun in any case: the chip executes one more.
#ifdef TRANSLATED_GUEST
#ifdef MAIN_REGION
#define BLOCK(at, last)                                                        \
    block_##at : if (__builtin_expect(left <= 0, 0)) ATTEND(at, 0, NO_CYCLES); \
    begun_##at:;
#else
#define BLOCK(at, last)                                                  \
    block_##at : if (__builtin_expect(left <= 0, 0)) STOP(at, 0, GO_ON); \
    begun_##at:;
#endif
#else
#define BLOCK(at, last) \
    block_##at : if (__builtin_expect(left <= (last), 0)) STOP(at, 0, INTERPRET_REST);
#endif
/// Jumps of a guest: backwards within a region, to a block, and to the begin of the main loop.
#define JUMP_BACK(to, spent)                                          \
    do {                                                              \
        if (__builtin_expect(--chip->turns <= 0, 0)) PASS(to, spent); \
        left -= (spent);                                              \
        goto block_##to;                                              \
    } while (0)
/// Both are the begin of a pass of a loop. The begin of a function that may be the engine's, and
/// the end of an interrupt. In the region that a guest is mostly in all these do not leave it.
#ifdef MAIN_REGION
#define PASS(to, spent)             \
    do {                            \
        left -= (spent), pc = (to); \
        goto pass;                  \
    } while (0)
#define ENGINE_CALL(at, number) \
    if (chip->calls >> (number)&1) ATTEND(at, 0, number);
#define END_INTERRUPT(at, spent) ATTEND(at, spent, END_OF_INTERRUPT)
#define ATTEND(at, spent, which)                        \
    do {                                                \
        left -= (spent), pc = (at), attended = (which); \
        goto attend;                                    \
    } while (0)
#else
#define PASS(to, spent) STOP(to, spent, CHECKPOINT)
#define ENGINE_CALL(at, number) \
    if (chip->calls >> (number)&1) STOP(at, 0, CALL_ENGINE);
#define END_INTERRUPT(at, spent) HAND_OVER(at, spent)
#endif
/// Writes a register that is plain memory, as WRITE_STATIC() does a variable. What others see of it
/// the engine is told (WRITE_REGISTER).
#ifdef TRANSLATED_GUEST
#define WRITE(address, r) \
    (net += translated_weight(address) * ((uint64_t)(r)-M[address]), M[address] = (r))
#else
#define WRITE(address, r) (M[address] = (r))
#endif
/// Writes SRAM, by a pointer and by a constant address, which is a variable's. What the pass has
/// changed is added up, whatever order it comes in; of the bytes that translated_below() is of only
/// that one has changed is kept.
#ifdef TRANSLATED_GUEST
#define WRITE_SRAM(address, r)                                   \
    do {                                                         \
        const uint64_t d_ = (uint64_t)(r)-M[address];            \
        const uint64_t b_ = (uint16_t)(top - (address)) < BELOW; \
        changed |= (uint8_t)(((d_ != 0) & b_) * CHANGED_BELOW);  \
        net += translated_weight(address) * d_ * (b_ ^ 1);       \
        M[address] = (r);                                        \
    } while (0)
#define WRITE_STATIC(address, r) \
    (net += translated_weight(address) * ((uint64_t)(r)-M[address]), M[address] = (r))
#else
#define WRITE_SRAM(address, r) WRITE(address, r)
#define WRITE_STATIC(address, r) WRITE(address, r)
#endif
/// Addresses below are registers, and there is nothing above.
#define IN_SRAM(address) ((uint16_t)((address)-0x100) < 0x800)
/// Two registers as one number, as the pointers X, Y and Z are, adiw's and sbiw's operands, and the
/// word that movw copies.
#define PAIR(low, high) ((uint16_t)((low) | (high) << 8))
/// The low byte first, as pairs lie in the registers.
#define SET_PAIR(low, high, value)                        \
    do {                                                  \
        const uint16_t p_ = (uint16_t)(value);            \
        (low) = (uint8_t)p_, (high) = (uint8_t)(p_ >> 8); \
    } while (0)
/// All eight flags in the status register's order.
#define SREG                                                                           \
    ((uint8_t)((int)cf | (zr == 0) << 1 | nr >> 7 << 2 | vr >> 7 << 3 | sr >> 7 << 4 | \
               (hr >> 4 & 1) << 5 | (int)tf << 6 | (int)inf << 7))

/// Flags are set as far as they are among `live`, bits in the status register's order: those that
/// may be read before they are set anew. `live` is a constant of the translator's
/// (host_tools/kilotwin/build/avr_liveness.py), so that the compiler leaves out what is for others;
/// a chip's code and the interpreter set all of them, and are what tests hold a guest's code
/// against. T and I have instructions of their own.
enum {
    FLAG_C = 1 << 0,
    FLAG_Z = 1 << 1,
    FLAG_N = 1 << 2,
    FLAG_V = 1 << 3,
    FLAG_S = 1 << 4,
    FLAG_H = 1 << 5,
    ALL_FLAGS = 0xFF
};
/// `what` is the flag's local, or the byte that has it. An instruction that reads the carry passes
/// it to its macro before this sets it.
#define SET_FLAG(live, flag, what, value)    \
    do {                                     \
        if ((live) & (flag)) what = (value); \
    } while (0)
/// Z, N, V and S by a result and by bit 7 of `v`: S is N, or V, but not both, the sign that the
/// result would have if it did not overflow.
#define SET_SIGNS(live, z, n, v)               \
    do {                                       \
        SET_FLAG(live, FLAG_Z, zr, z);         \
        SET_FLAG(live, FLAG_N, nr, n);         \
        SET_FLAG(live, FLAG_V, vr, v);         \
        SET_FLAG(live, FLAG_S, sr, (n) ^ (v)); \
    } while (0)

/// d + r + carry with its flags, to d. H is the carry from bit 3 to bit 4: without it, bit 4 of the
/// sum would be that of the exclusive or.
#define ADD(live, d, r, carry)                                     \
    do {                                                           \
        const uint8_t a_ = (d), b_ = (r);                          \
        const unsigned t_ = a_ + b_ + (carry);                     \
        const uint8_t x_ = (uint8_t)t_;                            \
        SET_FLAG(live, FLAG_C, cf, t_ >> 8);                       \
        SET_FLAG(live, FLAG_H, hr, a_ ^ b_ ^ x_);                  \
        SET_SIGNS(live, x_, x_, (uint8_t)((a_ ^ x_) & (b_ ^ x_))); \
        (d) = x_;                                                  \
    } while (0)
/// The flags of a - b - carry, where `keep` bits keep Z cleared: of numbers of several bytes Z says
/// whether all bytes are 0. `store` may take the result, x_.
#define COMPARE_(live, a, b, carry, keep, store)                            \
    do {                                                                    \
        const uint8_t a_ = (a), b_ = (b);                                   \
        const unsigned t_ = (unsigned)a_ - b_ - (carry);                    \
        const uint8_t x_ = (uint8_t)t_;                                     \
        SET_FLAG(live, FLAG_C, cf, t_ >> 8 & 1);                            \
        SET_FLAG(live, FLAG_H, hr, a_ ^ b_ ^ x_);                           \
        SET_SIGNS(live, (keep) | x_, x_, (uint8_t)((a_ ^ b_) & (a_ ^ x_))); \
        store;                                                              \
    } while (0)
/// Comparisons, and differences to d: without a carry and with it. Those with it clear Z or leave
/// it, so that they read it where it is live.
#define CP(live, a, b) COMPARE_(live, a, b, 0u, 0, (void)x_)
#define CPC(live, a, b) COMPARE_(live, a, b, cf, zr, (void)x_)
#define SUB(live, d, b) COMPARE_(live, d, b, 0u, 0, (d) = x_)
#define SBC(live, d, b) COMPARE_(live, d, b, cf, zr, (d) = x_)
/// The flags of bitwise operations and their result: V is cleared, so S is as N is; C and H stay.
/// tst is an `and` of a register with itself, clr an `eor`.
#define LOGIC(live, d, value)                \
    do {                                     \
        const uint8_t x_ = (uint8_t)(value); \
        SET_SIGNS(live, x_, x_, 0);          \
        (d) = x_;                            \
    } while (0)
/// All bits the other way round; C is set.
#define COM(live, d)                   \
    do {                               \
        LOGIC(live, d, ~(d));          \
        SET_FLAG(live, FLAG_C, cf, 1); \
    } while (0)
/// 0 - d: C is set unless that is 0.
#define NEG(live, d)                                 \
    do {                                             \
        const uint8_t b_ = (d), x_ = (uint8_t)-b_;   \
        SET_FLAG(live, FLAG_C, cf, x_ != 0);         \
        SET_FLAG(live, FLAG_H, hr, b_ ^ x_);         \
        SET_SIGNS(live, x_, x_, (uint8_t)(b_ & x_)); \
        (d) = x_;                                    \
    } while (0)
/// Counting leaves C and H as they are, so that loops over numbers of several bytes can count with
/// these. V tells a step over the end of the numbers with sign: from 127 up, from -128 down.
#define INC(live, d)                                    \
    do {                                                \
        const uint8_t a_ = (d), x_ = (uint8_t)(a_ + 1); \
        SET_SIGNS(live, x_, x_, (uint8_t)(~a_ & x_));   \
        (d) = x_;                                       \
    } while (0)
#define DEC(live, d)                                    \
    do {                                                \
        const uint8_t a_ = (d), x_ = (uint8_t)(a_ - 1); \
        SET_SIGNS(live, x_, x_, (uint8_t)(a_ & ~x_));   \
        (d) = x_;                                       \
    } while (0)
/// One place to the right, `top` (0 or 0x80) coming in: lsr, asr and ror; V is N or C, but not
/// both. To the left an addition shifts.
#define SHIFT(live, d, top)                                      \
    do {                                                         \
        const uint8_t a_ = (d), x_ = (uint8_t)(a_ >> 1 | (top)); \
        SET_SIGNS(live, x_, x_, (uint8_t)(x_ ^ a_ << 7));        \
        SET_FLAG(live, FLAG_C, cf, a_ & 1);                      \
        (d) = x_;                                                \
    } while (0)
/// Halves of a register change places; no flag changes.
#define SWAP(d) ((d) = (uint8_t)((d) << 4 | (d) >> 4))
/// A product to r0 and r1, shifted by 0 or 1: C is the bit that a fraction would shift out, also if
/// nothing is shifted.
#define MUL(live, product, shift)                                                \
    do {                                                                         \
        const uint16_t t_ = (uint16_t)(product), x_ = (uint16_t)(t_ << (shift)); \
        SET_FLAG(live, FLAG_C, cf, t_ >> 15);                                    \
        SET_FLAG(live, FLAG_Z, zr, (uint8_t)(x_ | x_ >> 8));                     \
        SET_PAIR(r0, r1, x_);                                                    \
    } while (0)
/// Registers in pairs and a constant; H stays.
#define ADIW(live, low, high, k)                                                                  \
    do {                                                                                          \
        const uint16_t a_ = PAIR(low, high), x_ = (uint16_t)(a_ + (k));                           \
        SET_FLAG(live, FLAG_C, cf, (uint16_t)(a_ & ~x_) >> 15);                                   \
        SET_SIGNS(live, (uint8_t)(x_ | x_ >> 8), (uint8_t)(x_ >> 8), (uint8_t)((~a_ & x_) >> 8)); \
        SET_PAIR(low, high, x_);                                                                  \
    } while (0)
#define SBIW(live, low, high, k)                                                                  \
    do {                                                                                          \
        const uint16_t a_ = PAIR(low, high), x_ = (uint16_t)(a_ - (k));                           \
        SET_FLAG(live, FLAG_C, cf, (uint16_t)(~a_ & x_) >> 15);                                   \
        SET_SIGNS(live, (uint8_t)(x_ | x_ >> 8), (uint8_t)(x_ >> 8), (uint8_t)((a_ & ~x_) >> 8)); \
        SET_PAIR(low, high, x_);                                                                  \
    } while (0)
/// T from a bit of a register, and back to a bit of the same or of another one; no other flag
/// changes.
#define BST(d, bit) (tf = (d) >> (bit)&1u)
#define BLD(d, bit) ((d) = (uint8_t)(((d) & ~(1u << (bit))) | tf << (bit)))

// Accesses. `at` and `offset` are those of the instruction, for HAND_OVER(), and nothing has
// changed when that is called: the interpreter executes the whole instruction.
/// From SRAM to d, and from r to SRAM. Elsewhere are registers, which have effects, or nothing,
/// which is a program's failure.
#define LOAD(at, offset, d, address)                                  \
    do {                                                              \
        const uint16_t m_ = (uint16_t)(address);                      \
        if (__builtin_expect(!IN_SRAM(m_), 0)) HAND_OVER(at, offset); \
        READ_COUNTED(m_);                                             \
        (d) = M[m_];                                                  \
    } while (0)
#define STORE(at, offset, address, r)                                 \
    do {                                                              \
        const uint16_t m_ = (uint16_t)(address);                      \
        if (__builtin_expect(!IN_SRAM(m_), 0)) HAND_OVER(at, offset); \
        NOTE_STORE(at, offset, m_, r);                                \
        WRITE_SRAM(m_, r);                                            \
    } while (0)
/// Before an access to a register below 0x100 that may have one of the effects.
#define FOR_EFFECT(at, offset, address, which) \
    if (__builtin_expect(effects[address] & (which), 0)) HAND_OVER(at, offset)
/// The same of a write.
#ifdef TRANSLATED_GUEST
#define FOR_WRITE(at, offset, address, r)                                           \
    FOR_EFFECT(at, offset, address, WRITE_EFFECT);                                  \
    if (__builtin_expect(effects[address] & CHANGE_EFFECT && M[address] != (r), 0)) \
    HAND_OVER(at, offset)
/// The byte itself. One that shows on a pin is told to the engine at its time, without leaving the
/// region: all that the engine does then is to look at the pins, and no interrupt moves. It says
/// what that makes of the pass.
#define WRITE_REGISTER(at, offset, address, r)                                     \
    do {                                                                           \
        const uint8_t shows_ = effects[address] & PIN_EFFECT && M[address] != (r); \
        WRITE(address, r);                                                         \
        if (__builtin_expect(shows_, 0)) {                                         \
            NOTE_PLACE(at, offset);                                                \
            chip->left = left - (offset);                                          \
            changed |= chip->pin_written(chip, address);                           \
        }                                                                          \
    } while (0)
#else
#define WRITE_REGISTER(at, offset, address, r) WRITE(address, r)
#define FOR_WRITE(at, offset, address, r) FOR_EFFECT(at, offset, address, WRITE_EFFECT)
#endif
/// A register below 0x100; three of them are locals, the status register is put together.
#define IN(at, offset, d, address)                     \
    do {                                               \
        FOR_EFFECT(at, offset, address, READ_EFFECT);  \
        (d) = (address) == 0x5D   ? (uint8_t)sp        \
              : (address) == 0x5E ? (uint8_t)(sp >> 8) \
              : (address) == 0x5F ? (M[0x5F] = SREG)   \
                                  : M[address];        \
    } while (0)
/// Whether the code itself may let interrupts through.
#ifdef TRANSLATED_GUEST
#define AWAITS (chip->awaits)
#else
#define AWAITS 0
#endif
/// Interrupts are held back, and let through.
#ifdef TRANSLATED_GUEST
#define HOLD(offset) (chip->held = left - (offset), inf = 0)
#define LET(offset)                                                              \
    do {                                                                         \
        if (!inf && chip->held - (left - (offset)) > MOST_HELD) changed |= HELD; \
        inf = 1;                                                                 \
    } while (0)
#else
#define HOLD(offset) (inf = 0)
#define LET(offset) (inf = 1)
#endif
/// A new stack pointer counts from the next instruction on, half by half as the program writes it.
/// Letting interrupts through is the interpreter's, since the next instruction is still before
/// them.
#define OUT(at, offset, address, r)                                                       \
    do {                                                                                  \
        const uint8_t o_ = (r);                                                           \
        FOR_WRITE(at, offset, address, o_);                                               \
        if ((address) == 0x5D) {                                                          \
            const uint16_t s_ = (uint16_t)((sp & 0xFF00) | o_);                           \
            if (__builtin_expect(!FOR_STACK(s_), 0)) HAND_OVER(at, offset);               \
            sp = s_;                                                                      \
        } else if ((address) == 0x5E) {                                                   \
            sp = (uint16_t)((sp & 0xFF) | o_ << 8);                                       \
        } else if ((address) == 0x5F) {                                                   \
            if (o_ >> 7 > inf && !AWAITS) HAND_OVER(at, offset);                          \
            M[0x5F] = o_;                                                                 \
            cf = o_ & 1u, zr = ~o_ & 2, nr = (uint8_t)(o_ << 5), vr = (uint8_t)(o_ << 4); \
            sr = (uint8_t)(o_ << 3), hr = (uint8_t)(o_ >> 1), tf = o_ >> 6 & 1u;          \
            if (o_ >> 7 > inf) LET(offset);                                               \
            if (o_ >> 7 < inf) HOLD(offset);                                              \
        } else {                                                                          \
            WRITE_REGISTER(at, offset, address, o_);                                      \
        }                                                                                 \
    } while (0)
/// From the flash as the program can read it at the moment.
#define LPM(at, offset, d, address)                                   \
    do {                                                              \
        const uint16_t m_ = (uint16_t)(address);                      \
        if (__builtin_expect(m_ >= 0x8000, 0)) HAND_OVER(at, offset); \
        (d) = flash[m_];                                              \
    } while (0)
/// Z is increased last, so that lpm r30, Z+ has no effect on r30.
#define LPM_NEXT(d, value)                                     \
    do {                                                       \
        const uint16_t next_ = (uint16_t)(PAIR(r30, r31) + 1); \
        (d) = (value);                                         \
        SET_PAIR(r30, r31, next_);                             \
    } while (0)

#endif

#endif
