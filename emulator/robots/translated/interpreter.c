#include <stdbool.h>

#define TRANSLATED_CODE
#define TRANSLATED_GUEST
#include "robots/translated/interpreter.h"

enum {
    SPL = 0x5D,
    SPH = 0x5E,
    SREG_ADDRESS = 0x5F,
    IO_END = 0x100,
    SRAM_END = 0x900,
    FLASH_MASK = 0x7FFF
};

/// A chip for the time of an instruction, with the names that the macros have for its parts.
typedef struct {
    translated_chip_t *chip;
    const registers_t *registers;
    uint8_t *data;
    unsigned c, t, i;
    uint8_t z, n, v, s, h, is_changed;
    uint16_t stack, word, next;
    uint32_t after;   ///< address of the next instruction
    unsigned cycles;  ///< of this one
} state_t;

#define M (state->data)
#define cf (state->c)
#define tf (state->t)
#define inf (state->i)
#define zr (state->z)
#define nr (state->n)
#define vr (state->v)
#define sr (state->s)
#define hr (state->h)
#define sp (state->stack)
#define changed (state->is_changed)
#define net (state->chip->net)
#define top (state->chip->pass->stack)
#define r0 (M[0])
#define r1 (M[1])
#define r30 (M[30])
#define r31 (M[31])

/// Flags as the chip has them, and as the macros keep them.
static void load_flags(state_t *state, const uint8_t *flags) {
    cf = flags[0], tf = flags[6], inf = flags[7];
    zr = !flags[1];
    nr = (uint8_t)(flags[2] << 7), vr = (uint8_t)(flags[3] << 7);
    sr = (uint8_t)(flags[4] << 7), hr = (uint8_t)(flags[5] << 4);
}

static void store_flags(const state_t *state, uint8_t *flags) {
    flags[0] = (uint8_t)cf, flags[1] = zr == 0, flags[2] = nr >> 7, flags[3] = vr >> 7;
    flags[4] = sr >> 7, flags[5] = hr >> 4 & 1, flags[6] = (uint8_t)tf, flags[7] = (uint8_t)inf;
}

/// All flags at once, from a byte in the status register's order.
static void set_status(state_t *state, uint8_t value) {
    cf = value & 1u, zr = ~value & 2, nr = (uint8_t)(value << 5), vr = (uint8_t)(value << 4);
    sr = (uint8_t)(value << 3), hr = (uint8_t)(value >> 1), tf = value >> 6 & 1u, inf = value >> 7;
}

/// Data space as the program sees it; behind SRAM there is nothing.
static uint8_t read_data(state_t *state, uint16_t address) {
    if (address >= SRAM_END) return 0;
    if (address == SPL) return (uint8_t)sp;
    if (address == SPH) return (uint8_t)(sp >> 8);
    if (address == SREG_ADDRESS) return SREG;
    if (address < IO_END && (state->chip->effects[address] & READ_EFFECT) != 0)
        return state->registers->read(state->chip, address);
    return M[address];
}

static void write_data(state_t *state, uint16_t address, uint8_t value) {
    if (address >= SRAM_END) return;
    if (address == SPL) {
        sp = (uint16_t)((sp & 0xFF00) | value);
    } else if (address == SPH) {
        sp = (uint16_t)((sp & 0xFF) | value << 8);
    } else if (address == SREG_ADDRESS) {
        set_status(state, value);
    } else if (address >= IO_END) {
        WRITE_SRAM(address, value);
    } else {
        const uint8_t effects = state->chip->effects[address];
        WRITE(address, value);
        if (effects & (WRITE_EFFECT | CHANGE_EFFECT | PIN_EFFECT))
            state->registers->written(state->chip, address);
    }
}

/// The stack: it grows downwards, and an address lies with its high byte first.
static void push_byte(state_t *state, uint8_t value) { write_data(state, sp--, value); }
static uint8_t pop_byte(state_t *state) { return read_data(state, ++sp); }

static void push_address(state_t *state, uint32_t address) {
    push_byte(state, (uint8_t)(address / 2));
    push_byte(state, (uint8_t)(address / 2 >> 8));
}

static uint32_t pop_address(state_t *state) {
    const unsigned high = pop_byte(state);
    return (high << 8 | pop_byte(state)) * 2;
}

/// Registers d and r; false if the word is none of these.
static bool two_registers(state_t *state) {
    const unsigned word = state->word;
    uint8_t *const d = &M[word >> 4 & 31];
    const uint8_t r = M[(word >> 5 & 16) | (word & 15)];
    switch (word >> 10) {
    case 0x01: CPC(ALL_FLAGS, *d, r); break;
    case 0x02: SBC(ALL_FLAGS, *d, r); break;
    case 0x03: ADD(ALL_FLAGS, *d, r, 0u); break;
    case 0x05: CP(ALL_FLAGS, *d, r); break;
    case 0x06: SUB(ALL_FLAGS, *d, r); break;
    case 0x07: ADD(ALL_FLAGS, *d, r, cf); break;
    case 0x08: LOGIC(ALL_FLAGS, *d, *d & r); break;
    case 0x09: LOGIC(ALL_FLAGS, *d, *d ^ r); break;
    case 0x0A: LOGIC(ALL_FLAGS, *d, *d | r); break;
    case 0x0B: *d = r; break;
    case 0x27:
        state->cycles = 2;
        MUL(ALL_FLAGS, *d * r, 0);
        break;
    default: return false;
    }
    return true;
}

/// A register from r16 on and a constant.
static bool immediate(state_t *state) {
    const unsigned word = state->word;
    uint8_t *const d = &M[16 + (word >> 4 & 15)];
    const uint8_t k = (uint8_t)((word >> 4 & 0xF0) | (word & 15));
    switch (word >> 12) {
    case 0x3: CP(ALL_FLAGS, *d, k); break;
    case 0x4: SBC(ALL_FLAGS, *d, k); break;
    case 0x5: SUB(ALL_FLAGS, *d, k); break;
    case 0x6: LOGIC(ALL_FLAGS, *d, *d | k); break;
    case 0x7: LOGIC(ALL_FLAGS, *d, *d & k); break;
    case 0xE: *d = k; break;
    default: return false;
    }
    return true;
}

/// Products of signed numbers and fractions, pairs of registers.
static bool pairs(state_t *state) {
    const unsigned word = state->word;
    const uint8_t d = M[16 + (word >> 4 & 7)], r = M[16 + (word & 7)];
    const unsigned pair = 24 + (word >> 3 & 6), k = (word >> 2 & 48) | (word & 15);
    const unsigned from = word << 1 & 30, to = word >> 3 & 30;
    const int8_t first = (int8_t)M[16 + (word >> 4 & 15)], second = (int8_t)M[16 + (word & 15)];
    state->cycles = 2;
    if (word >> 8 == 0x96) {
        ADIW(ALL_FLAGS, M[pair], M[pair + 1], k);
    } else if (word >> 8 == 0x97) {
        SBIW(ALL_FLAGS, M[pair], M[pair + 1], k);
    } else if (word >> 8 == 0x01) {
        state->cycles = 1;
        M[to] = M[from], M[to + 1] = M[from + 1];
    } else if (word >> 8 == 0x02) {
        MUL(ALL_FLAGS, first * second, 0);
    } else {
        switch (word & 0xFF88) {
        case 0x0300: MUL(ALL_FLAGS, (int8_t)d * r, 0); break;
        case 0x0308: MUL(ALL_FLAGS, d * r, 1); break;
        case 0x0380: MUL(ALL_FLAGS, (int8_t)d * (int8_t)r, 1); break;
        case 0x0388: MUL(ALL_FLAGS, (int8_t)d * r, 1); break;
        default: state->cycles = 1; return false;
        }
    }
    return true;
}

/// One register, and bits of it.
static bool one_register(state_t *state) {
    const unsigned word = state->word, bit = word & 7;
    uint8_t *const d = &M[word >> 4 & 31];
    if ((word & 0xFE08) == 0xF800) {
        BLD(*d, bit);
        return true;
    }
    if ((word & 0xFE08) == 0xFA00) {
        BST(*d, bit);
        return true;
    }
    switch (word & 0xFE0F) {
    case 0x9400: COM(ALL_FLAGS, *d); break;
    case 0x9401: NEG(ALL_FLAGS, *d); break;
    case 0x9402: SWAP(*d); break;
    case 0x9403: INC(ALL_FLAGS, *d); break;
    case 0x9405: SHIFT(ALL_FLAGS, *d, *d & 0x80); break;
    case 0x9406: SHIFT(ALL_FLAGS, *d, 0); break;
    case 0x9407: SHIFT(ALL_FLAGS, *d, cf << 7); break;
    case 0x940A: DEC(ALL_FLAGS, *d); break;
    default: return false;
    }
    return true;
}

/// A pointer's address, `before` added to it first and `behind` afterwards.
static uint16_t pointed(state_t *state, unsigned pair, int before, int behind) {
    const uint16_t address = (uint16_t)(PAIR(M[pair], M[pair + 1]) + before);
    SET_PAIR(M[pair], M[pair + 1], address + behind);
    return address;
}

/// Loads and stores by pointers, from flash, and by address. The pointer changes last.
static bool memory(state_t *state) {
    enum { X = 26, Y = 28, Z = 30 };
    const unsigned word = state->word;
    uint8_t *const d = &M[word >> 4 & 31];
    const bool is_store = (word & 0x200) != 0;
    uint16_t address = 0;
    state->cycles = 2;
    if ((word & 0xD000) == 0x8000) {
        const unsigned pair = word & 8 ? Y : Z;
        const unsigned k = (word >> 8 & 32) | (word >> 7 & 24) | (word & 7);
        address = (uint16_t)(PAIR(M[pair], M[pair + 1]) + k);
    } else {
        const uint8_t value = *d;
        switch (word & 0xFC0F) {
        case 0x9000:
            address = state->next;
            state->after += 2;
            break;
        case 0x9001: address = pointed(state, Z, 0, 1); break;
        case 0x9002: address = pointed(state, Z, -1, 0); break;
        case 0x9009: address = pointed(state, Y, 0, 1); break;
        case 0x900A: address = pointed(state, Y, -1, 0); break;
        case 0x900C: address = pointed(state, X, 0, 0); break;
        case 0x900D: address = pointed(state, X, 0, 1); break;
        case 0x900E: address = pointed(state, X, -1, 0); break;
        default: state->cycles = 1; return false;
        }
        if (is_store) {
            write_data(state, address, value);
            return true;
        }
    }
    if (is_store)
        write_data(state, address, *d);
    else
        *d = read_data(state, address);
    return true;
}

/// Input, output, stack and flash.
static bool transfer(state_t *state) {
    const unsigned word = state->word;
    uint8_t *const d = &M[word >> 4 & 31];
    const uint16_t port = (uint16_t)(32 + ((word >> 5 & 48) | (word & 15)));
    const uint16_t low_port = (uint16_t)(32 + (word >> 3 & 31));
    const uint8_t mask = (uint8_t)(1 << (word & 7));
    const uint8_t *const flash = state->chip->flash;
    if (word >> 11 == 0x16) {
        *d = read_data(state, port);
    } else if (word >> 11 == 0x17) {
        write_data(state, port, *d);
    } else if (word >> 8 == 0x98 || word >> 8 == 0x9A) {
        const uint8_t before = read_data(state, low_port);
        state->cycles = 2;
        write_data(state, low_port, word >> 8 == 0x98 ? before & (uint8_t)~mask : before | mask);
    } else if ((word & 0xFE0F) == 0x900F || (word & 0xFE0F) == 0x920F) {
        state->cycles = 2;
        if (word & 0x200)
            push_byte(state, *d);
        else
            *d = pop_byte(state);
    } else if (word == 0x95C8 || (word & 0xFE0E) == 0x9004) {
        const uint16_t from = PAIR(r30, r31);
        state->cycles = 3;
        *(word == 0x95C8 ? &r0 : d) = flash[from & FLASH_MASK];
        if ((word & 0xFE0F) == 0x9005) SET_PAIR(r30, r31, from + 1);
    } else {
        return false;
    }
    return true;
}

/// Leaves the next instruction out, of one word or of two.
static void skip(state_t *state, bool condition) {
    if (!condition) return;
    const unsigned skipped = state->next;
    const bool is_long = (skipped & 0xFC0F) == 0x9000 || (skipped & 0xFE0C) == 0x940C;
    state->after += is_long ? 4 : 2;
    state->cycles += is_long ? 2 : 1;
}

/// Branches and skips.
static bool condition(state_t *state) {
    const unsigned word = state->word, bit = word & 7;
    const uint8_t d = M[word >> 4 & 31], r = M[(word >> 5 & 16) | (word & 15)];
    const uint16_t low_port = (uint16_t)(32 + (word >> 3 & 31));
    if (word >> 10 == 0x3C || word >> 10 == 0x3D) {
        const bool is_set = (SREG >> bit & 1) != 0;
        if (is_set != (word >> 10 == 0x3C)) return true;
        state->cycles = 2;
        state->after += 2 * ((word >> 3 & 63) - (word >> 3 & 64));
    } else if (word >> 10 == 0x04) {
        skip(state, d == r);
    } else if ((word & 0xFC08) == 0xFC00 || word == 0xFFFF) {  // erased flash is sbrs r31, 7
        skip(state, (d >> bit & 1) == (word >> 9 & 1));
    } else if (word >> 8 == 0x99 || word >> 8 == 0x9B) {
        skip(state, (read_data(state, low_port) >> bit & 1) == (word >> 9 & 1));
    } else {
        return false;
    }
    return true;
}

/// Jumps, calls and their ends.
static bool flow(state_t *state) {
    const unsigned word = state->word;
    const uint32_t distance = 2 * ((word & 0xFFF) - (word << 1 & 0x1000));
    const uint32_t far = (uint32_t)(((word >> 3 & 62) | (word & 1)) << 17 | state->next << 1);
    const uint32_t pointer = PAIR(r30, r31) * 2u;
    if (word >> 12 == 0xC || word >> 12 == 0xD) {
        const bool is_call = word >> 12 == 0xD;
        if (is_call) push_address(state, state->after);
        state->cycles = is_call ? 3 : 2;
        state->after += distance;
    } else if ((word & 0xFE0C) == 0x940C) {
        const bool is_call = (word & 2) != 0;
        if (is_call) push_address(state, state->after + 2);
        state->cycles = is_call ? 4 : 3;
        state->after = far;
    } else if (word == 0x9409 || word == 0x9509) {
        if (word == 0x9509) push_address(state, state->after);
        state->cycles = word == 0x9509 ? 3 : 2;
        state->after = pointer;
    } else if (word == 0x9508 || word == 0x9518) {
        state->cycles = 4;
        state->after = pop_address(state);
        changed |= sp > state->chip->pass->stack;  // as RETURNED in translated/code.h
        if (word == 0x9518) inf = 1;
    } else {
        return false;
    }
    return true;
}

/// Flags one by one, and what has no effect here.
static bool flags_and_control(state_t *state) {
    const unsigned word = state->word, bit = word >> 4 & 7;
    if ((word & 0xFF0F) == 0x9408) {
        const uint8_t before = SREG, mask = (uint8_t)(1 << bit);
        set_status(state, word & 0x80 ? before & (uint8_t)~mask : before | mask);
        return true;
    }
    return word == 0 || word == 0x9588 || word == 0x9598 || word == 0x95A8 || word == 0x95E8;
}

#undef changed
#undef net
#undef top

bool interpret(translated_chip_t *chip, const registers_t *registers) {
    state_t own = {.chip = chip, .registers = registers, .data = chip->data, .cycles = 1};
    state_t *const state = &own;
    load_flags(state, chip->flags);
    sp = (uint16_t)(M[SPL] | M[SPH] << 8);
    state->word = flash_word(chip->flash, chip->pc);
    state->next = flash_word(chip->flash, chip->pc + 2);
    state->after = chip->pc + 2;
    if (!two_registers(state) && !immediate(state) && !pairs(state) && !one_register(state) &&
        !memory(state) && !transfer(state) && !condition(state) && !flow(state) &&
        !flags_and_control(state))
        return false;
    M[SPL] = (uint8_t)sp, M[SPH] = (uint8_t)(sp >> 8);
    store_flags(state, chip->flags);
    chip->left -= state->cycles;
    chip->pc = state->after & FLASH_MASK;
    chip->changed |= own.is_changed;
    return true;
}
