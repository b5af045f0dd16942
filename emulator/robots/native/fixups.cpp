#include "robots/native/fixups.h"

#include <cstring>

namespace kilotwin {

namespace {

constexpr int REGISTERS[] = {REG_RAX, REG_RCX, REG_RDX, REG_RBX, REG_RSP, REG_RBP,
                             REG_RSI, REG_RDI, REG_R8,  REG_R9,  REG_R10, REG_R11,
                             REG_R12, REG_R13, REG_R14, REG_R15};
constexpr int NO_REGISTER = -1;

/// An x86-64 instruction with a ModRM operand, decoded as far as its operand.
struct Instruction {
    bool escaped = false;  ///< its opcode is not of the one-byte table
    uint8_t opcode = 0;
    bool operand16 = false, wide = false, extended = false;  ///< prefixes 66, REX.W, any REX
    uint8_t mod = 0, reg = 0;
    int base = NO_REGISTER, index = NO_REGISTER;  ///< hardware numbers; mod 3: base is the operand
    uint8_t scale = 1;
    bool relative = false;  ///< to the next instruction
    int32_t displacement = 0;
    const uint8_t *end = nullptr;  ///< of the operand, ahead of any immediate
};

bool is_prefix(uint8_t byte) {
    constexpr uint8_t PREFIXES[] = {0x66, 0x67, 0xF2, 0xF3, 0xF0, 0x2E,
                                    0x36, 0x3E, 0x26, 0x64, 0x65};
    return std::memchr(PREFIXES, byte, sizeof PREFIXES) != nullptr;
}

// Intel's manual, volume 2, chapter 2.1: ModRM, SIB, displacement.
void decode_operand(Instruction &instruction, const uint8_t *at, bool more_base, bool more_index) {
    enum { FOLLOWS_SIB = 4, NO_INDEX = 4, NO_BASE = 5, DIRECT = 3 };
    instruction.mod = *at >> 6;
    instruction.reg = *at >> 3 & 7;
    uint8_t rm = *at++ & 7;
    bool has_base = true;
    if (instruction.mod != DIRECT && rm == FOLLOWS_SIB) {
        int index = (*at >> 3 & 7) | more_index << 3;
        if (index != NO_INDEX) instruction.index = index;
        instruction.scale = static_cast<uint8_t>(1 << (*at >> 6));
        rm = *at++ & 7;
        has_base = !(instruction.mod == 0 && rm == NO_BASE);
    } else if (instruction.mod == 0 && rm == NO_BASE) {
        has_base = false;
        instruction.relative = true;
    }
    if (has_base) instruction.base = rm | more_base << 3;
    if (instruction.mod == 1) {
        const uint8_t low = *at++;
        instruction.displacement = low < 0x80 ? low : low - 0x100;
    } else if (instruction.mod == 2 || !has_base) {
        std::memcpy(&instruction.displacement, at, sizeof instruction.displacement);
        at += sizeof instruction.displacement;
    }
    instruction.end = at;
}

Instruction decode(const uint8_t *at) {
    Instruction instruction;
    for (; is_prefix(*at); at++) instruction.operand16 |= *at == 0x66;
    uint8_t rex = 0;
    if ((*at & 0xF0) == 0x40) rex = *at++;
    instruction.extended = rex != 0;
    instruction.wide = rex & 8;
    bool more_base = rex & 1, more_index = rex & 2;

    const uint8_t escape = *at;
    instruction.escaped = true;
    if (escape == 0xC5) {  // VEX, two bytes
        at += 2;
    } else if (escape == 0xC4 || escape == 0x62) {  // VEX, three bytes, and EVEX, four
        more_base = !(at[1] & 0x20);
        more_index = !(at[1] & 0x40);
        at += escape == 0xC4 ? 3 : 4;
    } else if (escape == 0x0F) {
        at += at[1] == 0x38 || at[1] == 0x3A ? 2 : 1;
    } else {
        instruction.escaped = false;
    }
    instruction.opcode = *at++;
    decode_operand(instruction, at, more_base, more_index);
    return instruction;
}

const uint8_t *code_at(const greg_t *registers) {
    return reinterpret_cast<const uint8_t *>(registers[REG_RIP]);
}

/// Sign-extended from `bits`.
int64_t narrow(uint64_t value, unsigned bits) {
    return static_cast<int64_t>(value << (64 - bits)) >> (64 - bits);
}

/// The operand's value, zero-extended from `bits`.
uint64_t operand(const Instruction &instruction, const greg_t *registers, unsigned bits) {
    auto value_of = [&](int number) { return static_cast<uint64_t>(registers[REGISTERS[number]]); };
    constexpr int FIRST_HIGH_BYTE = 4;  // ah, ch, dh, bh
    uint64_t value = 0;
    if (instruction.mod == 3) {
        bool high = bits == 8 && !instruction.extended && instruction.base >= FIRST_HIGH_BYTE;
        value =
            high ? value_of(instruction.base - FIRST_HIGH_BYTE) >> 8 : value_of(instruction.base);
    } else {
        auto address = static_cast<uint64_t>(static_cast<int64_t>(instruction.displacement));
        if (instruction.base != NO_REGISTER) address += value_of(instruction.base);
        if (instruction.index != NO_REGISTER)
            address += value_of(instruction.index) * instruction.scale;
        if (instruction.relative) address += reinterpret_cast<uint64_t>(instruction.end);
        std::memcpy(&value, reinterpret_cast<const void *>(address), bits / 8);
    }
    return value << (64 - bits) >> (64 - bits);
}

/// Writes the low bits of a register as an instruction of that width does.
void put(greg_t &destination, uint64_t value, unsigned bits) {
    if (bits >= 32)
        destination = static_cast<greg_t>(bits == 32 ? static_cast<uint32_t>(value) : value);
    else
        std::memcpy(&destination, &value, bits / 8);
}

/// Whether the fault is of fetching the instruction itself: a program that has jumped away. There
/// is no instruction to decode then.
bool is_no_code(const uint8_t *code, const void *address) {
    constexpr uintptr_t LONGEST_INSTRUCTION = 15;
    return reinterpret_cast<uintptr_t>(address) - reinterpret_cast<uintptr_t>(code) <
           LONGEST_INSTRUCTION;
}

/// Whether the fault has an address. Those without one, as of a non-canonical pointer, report 0.
bool has_address(const greg_t *registers) {
    constexpr greg_t PAGE_FAULT = 14;
    return registers[REG_TRAPNO] == PAGE_FAULT;
}

}  // namespace

bool divide_as_avr(greg_t *registers) {
    enum { BYTE_DIVISION = 0xF6, DIVISION = 0xF7, UNSIGNED = 6, SIGNED = 7 };
    const Instruction instruction = decode(code_at(registers));
    if (instruction.escaped || (instruction.opcode & 0xFE) != BYTE_DIVISION) return false;
    if (instruction.reg != UNSIGNED && instruction.reg != SIGNED) return false;
    const unsigned bits = instruction.opcode == BYTE_DIVISION ? 8
                          : instruction.wide                  ? 64
                          : instruction.operand16             ? 16
                                                              : 32;
    const bool is_signed = instruction.reg == SIGNED;
    auto dividend = static_cast<uint64_t>(registers[REG_RAX]);
    uint64_t quotient = dividend, remainder = 0;
    if (operand(instruction, registers, bits) == 0) {
        quotient = is_signed && narrow(dividend, bits) < 0 ? 1 : UINT64_MAX;
        remainder = dividend;
    }
    if (bits == 8) {
        const auto both = static_cast<uint16_t>((quotient & 0xFF) | (remainder & 0xFF) << 8);
        put(registers[REG_RAX], both, 16);
    } else {
        put(registers[REG_RAX], quotient, bits);
        put(registers[REG_RDX], remainder, bits);
    }
    registers[REG_RIP] = reinterpret_cast<greg_t>(instruction.end);
    return true;
}

bool LostMemory::is_the_robots(const void *address) {
    auto number = reinterpret_cast<uintptr_t>(address);
    return number < RAM_END;
}

bool LostMemory::redirect(greg_t *registers, const void *address) {
    constexpr int STACK_POINTER = 4;
    const uint8_t *code = code_at(registers);
    if (redirected_ != -1 || !has_address(registers) || is_no_code(code, address)) return false;
    const Instruction instruction = decode(code);
    // The first table's 0xA0 to 0xAF have no ModRM: strings, and absolute addresses.
    if (!instruction.escaped && (instruction.opcode & 0xF0) == 0xA0) return false;
    const int pointer = instruction.base != NO_REGISTER ? instruction.base
                        : instruction.scale == 1        ? instruction.index
                                                        : NO_REGISTER;
    if (instruction.mod == 3 || pointer == NO_REGISTER || pointer == STACK_POINTER) return false;
    if (instruction.base == instruction.index) return false;
    memory_.fill(0);
    auto &value = registers[REGISTERS[pointer]];
    redirected_ = REGISTERS[pointer];
    original_ = value;
    value += reinterpret_cast<greg_t>(memory_.data() + WIDEST_ACCESS) -
             reinterpret_cast<greg_t>(address);
    replaced_ = value;
    registers[REG_EFL] |= TRAP_FLAG;
    return true;
}

// The instruction may have overwritten the register, by what it read for instance.
bool LostMemory::settle(greg_t *registers) {
    if (redirected_ == -1) return false;
    if (registers[redirected_] == replaced_) registers[redirected_] = original_;
    redirected_ = -1;
    registers[REG_EFL] &= ~TRAP_FLAG;
    return true;
}

}  // namespace kilotwin
