// Instructions of a pass, by where the bytes that they change come from (pass_tracer.h).
#include "robots/translated/passes/pass_tracer.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

unsigned d_of(unsigned word) { return word >> 4 & 31; }
unsigned r_of(unsigned word) { return (word >> 5 & 16) | (word & 15); }

}  // namespace

/// A register with itself is cleared by `eor`, tested by `and`; otherwise bitwise operations, like
/// products, want both bytes to be equal.
bool PassTracer::two_registers(unsigned word) {
    const unsigned d = d_of(word), r = r_of(word);
    const Byte byte = registers_[r];
    const uint8_t value = copy_[r];
    switch (word >> 10) {
    case 0x01: add(d, byte, value, {false, true, false}); return true;
    case 0x02: add(d, byte, value, {false, true, true}); return true;
    case 0x03: add(d, byte, value, {true, false, true}); return true;
    case 0x05: add(d, byte, value, {false, false, false}); return true;
    case 0x06: add(d, byte, value, {false, false, true}); return true;
    case 0x07: add(d, byte, value, {true, true, true}); return true;
    case 0x0B: set(d, byte); return true;
    case 0x08:
    case 0x09:
    case 0x0A: break;
    case 0x27:
        require(registers_[d]), require(byte);
        set(0), set(1);
        carry_ = zero_ = PLAIN;
        return true;
    default: return false;
    }
    zero_ = signs_ = PLAIN;
    if (word >> 10 == 0x09 && d == r) {
        set(d);
    } else if (word >> 10 == 0x08 && d == r) {  // tst
        zero_ = signs_ = {Flag::OF_BYTE, 0, 0, byte};
    } else {
        require(registers_[d]), require(byte);
        set(d);
    }
    return true;
}

/// A register from r16 on and a constant.
bool PassTracer::immediate(unsigned word) {
    const unsigned d = 16 + (word >> 4 & 15);
    const auto k = static_cast<uint8_t>((word >> 4 & 0xF0) | (word & 15));
    switch (word >> 12) {
    case 0x3: add(d, {}, k, {false, false, false}); return true;
    case 0x4: add(d, {}, k, {false, true, true}); return true;
    case 0x5: add(d, {}, k, {false, false, true}); return true;
    case 0x6:
    case 0x7:
        require(registers_[d]);
        zero_ = signs_ = PLAIN;
        [[fallthrough]];
    case 0xE: set(d); return true;
    default: return false;
    }
}

/// adiw and sbiw are chains of two bytes, of which Z tells both; movw copies where bytes come from.
bool PassTracer::pairs(unsigned word) {
    if (word >> 8 == 0x96 || word >> 8 == 0x97) {
        const unsigned low = 24 + (word >> 3 & 6);
        const auto k = static_cast<uint8_t>((word >> 2 & 48) | (word & 15));
        const bool is_sum = word >> 8 == 0x96;
        add(low, {}, k, {is_sum, false, true});
        const bool is_chain = carry_.kind == Flag::OF_CHAIN;
        copied_flags_[CARRY] = is_sum ? copy_[low] + k > UINT8_MAX : copy_[low] < k;
        add(low + 1, {}, 0, {is_sum, true, true});
        if (is_chain) chains_[carry_.chain].tells_zero = true;
        return true;
    }
    if (word >> 8 == 0x01) {
        const unsigned from = word << 1 & 30, to = word >> 3 & 30;
        const Byte low = registers_[from], high = registers_[from + 1];
        set(to, low), set(to + 1, high);
        return true;
    }
    if (word >> 8 != 0x02 && word >> 8 != 0x03) return false;
    const unsigned part = word >> 8 == 0x02 ? 15 : 7;
    require(registers_[16 + (word >> 4 & part)]), require(registers_[16 + (word & part)]);
    set(0), set(1);
    carry_ = zero_ = PLAIN;
    return true;
}

/// Each goes on to the flags that it shares with the next ones.
bool PassTracer::one_register(unsigned word) {
    const unsigned d = d_of(word);
    if ((word & 0xFC08) == 0xF800) {  // bld, bst
        if (sense_cycles_ != 0) fail();
        require(registers_[d]);
        if ((word & 0x200) == 0) set(d);
        return true;
    }
    switch (word & 0xFE0F) {
    case 0x9407: require(carry_); [[fallthrough]];
    case 0x9400:
    case 0x9401:
    case 0x9405:
    case 0x9406: carry_ = PLAIN; [[fallthrough]];
    case 0x9403:
    case 0x940A: zero_ = signs_ = PLAIN; [[fallthrough]];
    case 0x9402: require(registers_[d]); break;
    default: return false;
    }
    set(d);
    return true;
}

/// A pointer's bytes must be equal, so that the address is the same each time.
bool PassTracer::memory(unsigned word) {
    constexpr unsigned X = 26, Y = 28;
    const unsigned d = d_of(word);
    const bool is_store = (word & 0x200) != 0;
    unsigned pair = word & 8 ? Y : Z_POINTER;
    int before = 0, moves = 0;
    if ((word & 0xD000) == 0x8000) {
        before = static_cast<int>((word >> 8 & 32) | (word >> 7 & 24) | (word & 7));
    } else if ((word & 0xFC0F) == 0x9000) {
        pair = REGISTERS_END;
    } else {
        switch (word & 0xFC0F) {
        case 0x9001:
        case 0x9009: moves = 1; break;
        case 0x9002:
        case 0x900A: before = -1, moves = 1; break;
        case 0x900C: pair = X; break;
        case 0x900D: pair = X, moves = 1; break;
        case 0x900E: pair = X, before = -1, moves = 1; break;
        default: return false;
        }
    }
    uint16_t address = flash_word(flash, pc + 2);
    if (pair < REGISTERS_END) {
        require(registers_[pair]), require(registers_[pair + 1]);
        address = static_cast<uint16_t>(pointer(pair) + before);
    }
    if (is_store)
        store(address, registers_[d], copy_[d]);
    else
        set(d, load(address));
    if (moves != 0) set(pair), set(pair + 1);
    return true;
}

/// Input, output, stack and flash. What changes whether interrupts are let through fails: one that
/// waits for that comes later than known.
bool PassTracer::transfer(unsigned word) {
    const unsigned d = d_of(word);
    const auto port = static_cast<uint16_t>(32 + ((word >> 5 & 48) | (word & 15)));
    const uint16_t stack = pointer(SPL);
    const bool is_stack = port == SPL || port == SPH;
    if (word >> 11 == 0x16) {
        set(d, is_stack ? Byte{} : port == STATUS ? load_status() : load(port));
    } else if (word >> 11 == 0x17) {
        const Byte &byte = registers_[d];
        const bool is_status = byte.kind == Byte::BEFORE && byte.place == STATUS;
        if (is_status != (port == STATUS)) fail();
        if (is_status)
            set_flags({});
        else if (is_stack)
            require(registers_[d]);
        else
            store(port, registers_[d], copy_[d]);
    } else if ((word & 0xFE0F) == 0x920F) {
        store(stack, registers_[d], copy_[d]);
    } else if ((word & 0xFE0F) == 0x900F) {
        if (stack >= stack_) fail();
        set(d, load(static_cast<uint16_t>(stack + 1)));
    } else if (word == 0x95C8 || (word & 0xFE0E) == 0x9004) {
        require(registers_[Z_POINTER]), require(registers_[Z_POINTER + 1]);
        set(word == 0x95C8 ? 0 : d);
        if ((word & 0xFE0F) == 0x9005) set(Z_POINTER), set(Z_POINTER + 1);
    } else {
        return false;
    }
    return true;
}

/// Branches on flags and skips on bits are what conditions come from.
bool PassTracer::branches(unsigned word) {
    const unsigned d = d_of(word), bit = word & 7;
    if (word >> 10 == 0x3C || word >> 10 == 0x3D) {
        if (bit == CARRY)
            note(carry_, bit);
        else if (bit == ZERO)
            note(zero_, bit);
        else if (bit == NEGATIVE || bit == SIGN)
            note(signs_, bit);
        else if (bit != INTERRUPTS && (bit != BIT_COPY || sense_cycles_ != 0))
            fail();
    } else if (word >> 10 == 0x04) {
        require(registers_[d]), require(registers_[r_of(word)]);
    } else if ((word & 0xFC08) == 0xFC00) {
        Byte byte = registers_[d];
        if (!is_constant(byte) && has_ticks(byte))
            note_bit(byte, bit);
        else
            require(byte);
    } else if (word >> 8 == 0x99 || word >> 8 == 0x9B) {
        require(load(static_cast<uint16_t>(32 + (word >> 3 & 31))));
    } else {
        return false;
    }
    return true;
}

/// Jumps and calls, and a return to a call of this pass; what is left over sets C or T,
/// or is no instruction that can be known.
bool PassTracer::flow(unsigned word) {
    const bool is_pointer = word == 0x9409 || word == 0x9509;
    const bool is_near = word >> 12 == 0xC || word >> 12 == 0xD;
    const bool is_far = (word & 0xFE0C) == 0x940C;
    const uint16_t stack = pointer(SPL);
    if (is_pointer) require(registers_[Z_POINTER]), require(registers_[Z_POINTER + 1]);
    if (word == 0x9508) {
        if (stack + 2u > stack_) fail();
        require(load(static_cast<uint16_t>(stack + 1)));
        require(load(static_cast<uint16_t>(stack + 2)));
    } else if (word >> 12 == 0xD || (is_far && (word & 2) != 0) || word == 0x9509) {
        // The value before does not matter.
        store(stack, {}, 0);
        store(static_cast<uint16_t>(stack - 1), {}, 0);
    } else if (!is_pointer && !is_near && !is_far) {
        if (word == 0x9408 || word == 0x9488) carry_ = PLAIN;  // sec, clc
        return word == 0 || word == 0x9408 || word == 0x9488 || word == 0x9468 || word == 0x94E8;
    }
    return true;
}

}  // namespace kilotwin
