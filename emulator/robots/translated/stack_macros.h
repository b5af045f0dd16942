/// Macros of instructions that push and pop: part of translated/code.h, for regions alone.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_STACK_MACROS_H
#define KILOTWIN_ROBOTS_TRANSLATED_STACK_MACROS_H

/// The stack grows downwards; its pointer is to the next free byte.
#define PUSH(at, offset, r)                                             \
    do {                                                                \
        if (__builtin_expect(!FOR_STACK(sp), 0)) HAND_OVER(at, offset); \
        NOTE_PUSH(sp);                                                  \
        M[sp--] = (r);                                                  \
    } while (0)
/// The byte last pushed, to d. It stays in SRAM, as on the chip.
#define POP(at, offset, d)                                                \
    do {                                                                  \
        if (__builtin_expect(!IN_SRAM(sp + 1), 0)) HAND_OVER(at, offset); \
        (d) = M[++sp];                                                    \
    } while (0)
/// The word address behind a call, low byte first, as the chip has it.
#define PUSH_RETURN(at, offset, to)                                                           \
    do {                                                                                      \
        if (__builtin_expect(!FOR_STACK(sp) || !FOR_STACK(sp - 1), 0)) HAND_OVER(at, offset); \
        M[sp] = (uint8_t)((to) / 2), M[sp - 1] = (uint8_t)((to) / 2 >> 8);                    \
        NOTE_JUMP(0);                                                                         \
        NOTE_PUSH(sp - 1);                                                                    \
        sp = (uint16_t)(sp - 2);                                                              \
        NOTE_DEPTH;                                                                           \
    } while (0)
/// Goes where the stack says, `cycles` after the block's begin.
#define RETURN(at, offset, cycles)                                                            \
    do {                                                                                      \
        if (__builtin_expect(!IN_SRAM(sp + 1) || !IN_SRAM(sp + 2), 0)) HAND_OVER(at, offset); \
        NOTE_JUMP(0);                                                                         \
        sp = (uint16_t)(sp + 2);                                                              \
        RETURNED                                                                              \
        GO_TO((uint32_t)(M[sp - 1] << 8 | M[sp]) * 2, cycles);                                \
    } while (0)

#endif
