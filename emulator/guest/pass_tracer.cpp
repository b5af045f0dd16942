#include "guest/pass_tracer.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "base/clock.h"
#include "kilolib/core/robot_commands.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr int MOST_INSTRUCTIONS = 3000;
constexpr uint32_t MOST_CYCLES = TICK_CYCLES / 4;
constexpr unsigned Z_POINTER = 30, BYTE_BITS = 8;
constexpr uint16_t REGISTERS_END = 0x20, IO_END = 0x100;
constexpr uint16_t INTERRUPTED = 64;  // bytes that a tick's interrupt may push
constexpr uint32_t FLASH_MASK = 0x7FFE;
enum { CARRY = 0, ZERO = 1, NEGATIVE = 2, SIGN = 4, BIT_COPY = 6, INTERRUPTS = 7 };

/// Registers that a function may change (avr-gcc): where a pass begins nothing is in them.
constexpr bool is_scratch(uint16_t address) {
    return address == 0 || (address >= 18 && address <= 27) || address == 30 || address == 31;
}

unsigned d_of(unsigned word) { return word >> 4 & 31; }
unsigned r_of(unsigned word) { return (word >> 5 & 16) | (word & 15); }

uint8_t no_read(translated_chip_t *chip, uint16_t address) { return chip->data[address]; }
void no_write(translated_chip_t * /*chip*/, uint16_t /*address*/) {}

}  // namespace

PassTracer::PassTracer(const translation_t &code, const translated_chip_t &chip)
    : translated_chip_t(chip),
      code_(code),
      seam_(*code.seam),
      before_(chip.data),
      stack_(static_cast<uint16_t>(chip.data[SPL] | chip.data[SPH] << 8)),
      begin_(chip.pc),
      deepest_(stack_),
      bit_copy_(chip.flags[BIT_COPY]) {
    std::memcpy(copy_.data(), chip.data, copy_.size());
    std::memcpy(copied_flags_.data(), chip.flags, copied_flags_.size());
    std::memcpy(&ticks_, chip.data + seam_.ticks, sizeof ticks_);
    data = copy_.data();
    flags = copied_flags_.data();
    pass = &no_pass_;
    left = MOST_CYCLES;
    for (uint16_t at = 0; at < registers_.size(); at++) registers_[at] = {Byte::BEFORE, 0, at};
    TickNumber ticks;
    ticks.slope = 1;
    new_sum(ticks);
}

std::optional<KnownPass> PassTracer::trace() {
    KnownPass known = {};
    try {
        follow();
        finish(known);
    } catch (const Failed &) {
        return std::nullopt;
    }
    return known;
}

void PassTracer::follow() {
    int instructions = 0;
    do {
        if (++instructions > MOST_INSTRUCTIONS || left <= 0) fail();
        step();
    } while (pc != begin_);
    const bool is_back = pointer(SPL) == stack_ && copied_flags_[BIT_COPY] == bit_copy_;
    if (!is_back) fail();
}

/// What the pass has written must be what was there, and depend on nothing that may differ. Bytes
/// below the stack pointer do not count; an interrupt writes some more below the lowest one.
void PassTracer::finish(KnownPass &known) {
    auto check = [this](uint16_t address, const Byte &byte) {
        if (byte.kind == Byte::BEFORE && byte.place == address) return;
        require(byte);
        require(address);
        if (copy_[address] != before_[address]) fail();
    };
    for (uint16_t at = 0; at < REGISTERS_END; at++)
        if (!is_scratch(at)) check(at, registers_[at]);
    for (uint16_t at = 0; at < DATA_END; at++) {
        const bool is_frame = at > deepest_ && at <= stack_;
        if (written_[at] && !is_frame) check(at, memory_[at]);
        if (loaded_[at] && at + INTERRUPTED > deepest_ && at <= stack_) fail();
    }
    known.pc = begin_;
    known.stack = stack_;
    known.status = static_cast<uint8_t>(copied_flags_[BIT_COPY] << BIT_COPY |
                                        copied_flags_[INTERRUPTS] << INTERRUPTS);
    known.cycles = static_cast<uint32_t>(MOST_CYCLES - left);
    known.reads_from = first_read_;
    known.reads_to = last_read_;
    for (uint16_t at = 0; at < DATA_END; at++)
        if (equal_[at]) known.equal.push_back({at, before_[at]});
    known.conditions = std::move(conditions_);
}

void PassTracer::step() {
    static constexpr registers_t REGISTERS = {no_read, no_write};
    const auto *const end = std::end(seam_.calls);
    if (std::find(std::begin(seam_.calls), end, pc) != end) fail();
    if (code_.region_of[pc / 2] != 0) block_ = static_cast<uint32_t>(MOST_CYCLES - left);
    const unsigned word = flash_word(flash, pc);
    if (!two_registers(word) && !immediate(word) && !pairs(word) && !one_register(word) &&
        !memory(word) && !transfer(word) && !branches(word) && !flow(word))
        fail();
    const uint32_t at = pc;
    if (!interpret(this, &REGISTERS)) fail();
    deepest_ = std::min(deepest_, pointer(SPL));
    const bool jumps = pc != ((at + 2) & FLASH_MASK) && pc != ((at + 4) & FLASH_MASK);
    if (jumps && code_.region_of[pc / 2] == 0) fail();
}

// Where bytes come from

/// It may have become one since.
bool PassTracer::is_constant(Byte &byte) {
    const bool is_now = (byte.kind == Byte::BEFORE && equal_[byte.place]) ||
                        (byte.kind == Byte::OF_SUM && known_[byte.place]);
    if (is_now) byte = {};
    return byte.kind == Byte::CONSTANT;
}

void PassTracer::require(uint16_t address) {
    if (is_scratch(address)) fail();
    equal_.set(address);
}

void PassTracer::require(const TickNumber &number) {
    if (number.slope != 0) fail();
    for (const auto &term : number.terms) require(term.address);
}

void PassTracer::require(Byte byte) {
    if (is_constant(byte)) return;
    if (byte.kind == Byte::BEFORE) return require(byte.place);
    require(sums_[byte.place]);
    known_[byte.place] = true;
}

void PassTracer::require(Flag &flag) {
    if (flag.kind == Flag::UNKNOWN) fail();
    if (flag.kind == Flag::OF_BYTE) require(flag.byte);
    if (flag.kind == Flag::OF_CHAIN) {
        require(chains_[flag.chain].a.number);
        require(chains_[flag.chain].b.number);
    }
    flag = PLAIN;
}

void PassTracer::require_all_flags() {
    require(carry_);
    require(zero_);
    require(signs_);
}

PassTracer::Byte PassTracer::load(uint16_t address) {
    if (address < REGISTERS_END || address >= DATA_END) fail();
    if (address < IO_END && (effects[address] & READ_EFFECT) != 0) fail();
    if (written_[address]) return memory_[address];
    const unsigned of_ticks = address - seam_.ticks;
    if (of_ticks < sizeof ticks_) {
        if (!reads_ticks_) first_read_ = block_;
        reads_ticks_ = true;
        last_read_ = block_;
        return {Byte::OF_SUM, static_cast<uint8_t>(of_ticks), 0};
    }
    if (is_of_clock(address)) fail();
    loaded_.set(address);
    return {Byte::BEFORE, 0, address};
}

/// Addresses that a tick's interrupt changes.
bool PassTracer::is_of_clock(uint16_t address) const {
    constexpr uint16_t CLOCK = offsetof(robot_core_t, transmit);
    return static_cast<uint16_t>(address - seam_.ticks) < sizeof ticks_ ||
           static_cast<uint16_t>(address - (seam_.robot + CLOCK)) < sizeof(transmit_clock_t);
}

/// A register that is not plain memory must already have the byte.
void PassTracer::store(uint16_t address, Byte byte, uint8_t value) {
    if (address < REGISTERS_END || address >= DATA_END || is_of_clock(address)) fail();
    if (address < IO_END) {
        if ((effects[address] & (READ_EFFECT | WRITE_EFFECT)) != 0) fail();
        if (copy_[address] != value) fail();
        require(byte);
        require(address);
    }
    memory_[address] = byte;
    written_.set(address);
}

uint16_t PassTracer::pointer(unsigned pair) const {
    return static_cast<uint16_t>(copy_[pair] | copy_[pair + 1] << BYTE_BITS);
}

// Numbers

/// They are few in a pass that only looks at the time.
uint16_t PassTracer::new_sum(const TickNumber &number) {
    if (sums_.size() >= MOST_NUMBERS) fail();
    sums_.push_back(number);
    known_.push_back(false);
    return static_cast<uint16_t>(sums_.size() - 1);
}

/// The chain that an instruction goes on with, or a new one. An addition's Z is of its last byte.
PassTracer::Chain &PassTracer::chain_for(bool is_sum, bool takes_carry) {
    if (takes_carry && carry_.kind == Flag::OF_CHAIN) {
        Chain &chain = chains_[carry_.chain];
        if (chain.is_sum != is_sum || chain.bytes != carry_.bytes || chain.bytes >= MOST_BYTES)
            fail();
        const bool tells_on = zero_.kind == Flag::OF_CHAIN && zero_.chain == carry_.chain &&
                              zero_.bytes == carry_.bytes;
        chain.tells_zero = chain.tells_zero && tells_on && !is_sum;
        return chain;
    }
    if (takes_carry && carry_.kind != Flag::CONSTANT) fail();
    const uint64_t carry = takes_carry ? copied_flags_[CARRY] : 0;
    chains_.push_back({is_sum, !takes_carry, 0, carry, {}, {}, new_sum({})});
    return chains_.back();
}

/// Byte `at` of an operand, which follows those that it has.
void PassTracer::append(Operand &operand, Byte byte, uint8_t value, unsigned at) {
    const unsigned shift = at * BYTE_BITS;
    if (byte.kind == Byte::OF_SUM && byte.at == at && (at == 0 || operand.sum == byte.place)) {
        operand.sum = byte.place;
        operand.number = sums_[byte.place];
        return;
    }
    if (operand.sum >= 0) {  // of a sum only the lower bytes: it must be equal
        require(operand.number);
        const uint64_t low = (uint64_t{1} << shift) - 1;
        operand.number = {0, operand.number.value(before_, ticks_) & low, {}};
        operand.sum = -1;
    }
    if (byte.kind == Byte::OF_SUM) require(byte);
    if (byte.kind == Byte::BEFORE)
        operand.number.terms.push_back({byte.place, static_cast<uint8_t>(shift), 1});
    else
        operand.number.constant += uint64_t{value} << shift;
}

/// An addition, difference or comparison of a register and a byte.
void PassTracer::add(unsigned d, Byte b, uint8_t value, const Sum &kind) {
    Byte a = registers_[d];
    const bool is_plain = is_constant(a) && is_constant(b);
    if (is_plain && (!kind.takes_carry || carry_.kind == Flag::CONSTANT)) {
        if (kind.takes_carry && !kind.is_sum) require(zero_);
        if (kind.keeps) set(d);
        return set_flags(PLAIN);
    }
    is_constant(b);
    Chain &chain = chain_for(kind.is_sum, kind.takes_carry);
    const auto index = static_cast<uint16_t>(&chain - chains_.data());
    append(chain.a, a, copy_[d], chain.bytes);
    append(chain.b, b, value, chain.bytes);
    TickNumber sum = chain.a.number;
    sum.add(chain.b.number, kind.is_sum ? 1 : -1);
    sum.constant += kind.is_sum ? chain.carry : ~chain.carry + 1;
    if (std::abs(sum.slope) > 1 || sum.terms.size() > MOST_TERMS) fail();
    sums_[chain.result] = sum;
    known_[chain.result] = sum.slope == 0 && sum.terms.empty();
    chain.bytes++;
    const auto bytes = static_cast<uint8_t>(chain.bytes);
    if (kind.keeps) set(d, {Byte::OF_SUM, static_cast<uint8_t>(bytes - 1), chain.result});
    set_flags({Flag::OF_CHAIN, index, bytes, {}});
}

/// Slopes are those that TickCondition can count with; what the pass found is checked once.
void PassTracer::note(TickCondition condition) {
    for (const auto *number : {&condition.a, &condition.b}) {
        if (std::abs(number->slope) > 1) fail();
        for (const auto &term : number->terms)
            if (is_scratch(term.address)) fail();
    }
    if (std::abs(condition.a.slope - condition.b.slope) > 1) fail();
    if (condition.lasts(before_, ticks_) == 0) fail();
    conditions_.push_back(std::move(condition));
}

void PassTracer::note_bit(const Byte &byte, unsigned bit) {
    const unsigned at = byte.at * BYTE_BITS + bit;
    const TickNumber &number = sums_[byte.place];
    const bool is_set = (number.value(before_, ticks_) >> at & 1) != 0;
    note({TickCondition::Kind::BIT,
          static_cast<uint8_t>(at + 1),
          static_cast<uint8_t>(at),
          is_set,
          number,
          {}});
}

/// A branch depends on the flag that has the number `bit` in the status register.
void PassTracer::note(Flag &flag, unsigned bit) {
    using Kind = TickCondition::Kind;
    const bool is_sign = bit == NEGATIVE || bit == SIGN;
    if (flag.kind == Flag::OF_BYTE && has_ticks(flag.byte)) {
        if (!is_sign) fail();
        return note_bit(flag.byte, BYTE_BITS - 1);
    }
    if (flag.kind != Flag::OF_CHAIN) return require(flag);
    const Chain &chain = chains_[flag.chain];
    const TickNumber &a = chain.a.number, &b = chain.b.number;
    if (a.slope == 0 && b.slope == 0) return require(flag);
    const bool compares = !chain.is_sum && chain.carry == 0;
    const auto bits = static_cast<uint8_t>(chain.bytes * BYTE_BITS);
    const bool outcome = copied_flags_[bit] != 0;
    if (flag.bytes != chain.bytes) fail();
    if (bit == CARRY && compares) return note({Kind::LESS, bits, 0, outcome, a, b});
    if (bit == SIGN && compares) return note({Kind::LESS_SIGNED, bits, 0, outcome, a, b});
    if (bit == ZERO && chain.tells_zero)
        return note({Kind::ZERO, bits, 0, outcome, sums_[chain.result], {}});
    if (bit != NEGATIVE) fail();
    note({Kind::BIT, bits, static_cast<uint8_t>(bits - 1), outcome, sums_[chain.result], {}});
}

// Instructions

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
        if (port == STATUS) require_all_flags();
        set(d, is_stack || port == STATUS ? Byte{} : load(port));
    } else if (word >> 11 == 0x17) {
        if (port == STATUS) fail();
        if (is_stack)
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
        else if (bit != BIT_COPY && bit != INTERRUPTS)
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
