// Mistakes of a program that its machine code shows, each told with its line (translated/robot.h).
#include <cstddef>
#include <cstdio>

#include "robots/translated/avr_calls.h"
#include "robots/translated/robot.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr uint16_t NO_CODE = 0xFFFF;  // erased flash
constexpr uint16_t REGISTERS_END = 0x20;

/// An access to memory: by which pair of registers, or none, and where.
struct Access {
    bool is_one = false, is_store = false;
    uint16_t base = 0, address = 0;
};

Access access_of(const uint8_t *flash, uint32_t pc, const uint8_t *data) {
    constexpr unsigned X = 26, Y = 28, Z = 30;
    const uint16_t word = flash_word(flash, pc);
    const auto by = [&](unsigned pair, int offset) {
        const auto base = static_cast<uint16_t>(data[pair] | data[pair + 1] << 8);
        return Access{true, (word & 0x200) != 0, base, static_cast<uint16_t>(base + offset)};
    };
    if ((word & 0xD000) == 0x8000)
        return by((word & 8) != 0 ? Y : Z, (word >> 8 & 32) | (word >> 7 & 24) | (word & 7));
    switch (word & 0xFC0F) {
    case 0x9000: {
        const uint16_t address = flash_word(flash, pc + 2);
        return {true, (word & 0x200) != 0, address, address};
    }
    case 0x9001: return by(Z, 0);
    case 0x9002: return by(Z, -1);
    case 0x9009: return by(Y, 0);
    case 0x900A: return by(Y, -1);
    case 0x900C:
    case 0x900D: return by(X, 0);
    case 0x900E: return by(X, -1);
    default: return {};
    }
}

/// avr-libc's eeprom_read_word() and its like store by X into the registers of their result.
bool is_result_of_eeprom(uint16_t word, const Access &access) {
    constexpr uint16_t STORE_R0_BY_X = 0x920D;
    return word == STORE_R0_BY_X && access.base >= 22 && access.base <= 25;
}

/// Bytes that an instruction puts on the stack.
unsigned pushes(uint16_t word) {
    if ((word & 0xFE0F) == 0x920F) return 1;
    const bool calls = (word & 0xF000) == 0xD000 || (word & 0xFE0E) == 0x940E || word == 0x9509;
    return calls ? 2 : 0;
}

/// Where the stack's pointer will be behind an instruction that may make it grow.
uint16_t stack_behind(uint16_t word, const uint8_t *data) {
    constexpr uint16_t OUT_SPL = 0xBE0D, OUT_SPL_MASK = 0xFE0F;
    const auto stack = static_cast<uint16_t>(data[SPL] | data[SPH] << 8);
    if ((word & OUT_SPL_MASK) == OUT_SPL)
        return static_cast<uint16_t>((stack & 0xFF00) | data[word >> 4 & 31]);
    return pushes(word) == 0 ? UINT16_MAX : static_cast<uint16_t>(stack - pushes(word));
}

}  // namespace

/// Once each, with the line.
void TranslatedRobot::note(uint8_t mistake, const char *text) {
    if ((robot_.noted & mistake) != 0) return;
    robot_.now = world_time();
    robot_.last_tick = ticks_now();
    robot_.note(mistake, text, avr_code_path(pc, data, flash));
}

/// Looks at the instruction at the program counter, which the translation has left to the
/// interpreter: accesses outside of SRAM and jumps to flash without code come here. True if the
/// robot has stopped.
bool TranslatedRobot::makes_mistake() {
    const uint16_t word = flash_word(flash, pc), stack = this->word(SPL);
    if (word == NO_CODE) {
        note(LEAVES_PROGRAM, "it left its program, for flash without code; as on the robot, that "
                             "leads to address 0, where it starts again with main()");
        image_.strays = true;
        return false;
    }
    if (stack < SRAM_BEGIN + pushes(word) - 1 && pushes(word) != 0) {
        robot_.now = world_time();
        robot_.last_tick = ticks_now();
        robot_.stop(EventKind::STACK_OVERFLOW,
                    "its stack grew over the robot's 2 KB of memory, through its variables and "
                    "into the registers",
                    avr_code_path(pc, data, flash));
        return true;
    }
    look_at_stack(stack_behind(word, data));
    const Access access = access_of(flash, pc, data);
    const bool is_wild = access.base < REGISTERS_END || access.address >= SRAM_END;
    if (access.is_one && is_wild && !is_result_of_eeprom(word, access)) {
        char text[128];
        std::snprintf(text, sizeof text,
                      "it %s by a pointer that is NULL or wild, at address 0x%03x: %s",
                      access.is_store ? "writes" : "reads", access.address,
                      access.address >= SRAM_END ? "there is no memory"
                                                 : "there are the processor's registers");
        note(LOST_POINTER, text);
    }
    return false;
}

/// Where code begins at address 0: not so when it is switched on, nor at RESET.
void TranslatedRobot::starts_again() {
    const bool is_order =
        image_.interrupt == Interrupt::MESSAGE &&
        at(static_cast<uint16_t>(seam_.message + offsetof(message_t, type))) == RESET;
    if (cycle() > 0 && !is_order && !image_.strays)
        note(JUMPS_TO_ZERO, "it jumped to address 0, as by a call through a NULL pointer; as on "
                            "the robot, it starts again with main() and waits for RUN");
    image_.strays = false;
}

/// With its pointer there. Translated code leaves instructions by which a stack comes so deep to
/// the interpreter; what interrupts push a tick finds.
void TranslatedRobot::look_at_stack(uint16_t pointer) {
    if (pointer < seam_.variables_end)
        note(STACK_MEETS_DATA, "its stack has grown down to its variables, and overwrites them");
}

/// In code that divides.
void TranslatedRobot::divides_by_zero() {
    note(DIVIDES_BY_ZERO, "it divides by zero; as on the robot, it goes on with a wrong number");
}

}  // namespace kilotwin
