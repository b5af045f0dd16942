// A program that holds interrupts back while a tick waits (translated/robot.h).
#include <algorithm>
#include <array>
#include <cstring>

#include "robots/translated/robot.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr int MOST_TRIED = 4000;
constexpr int64_t MOST_CYCLES = CYCLES_PER_SECOND;
constexpr uint16_t SREG_PORT = 0x3F;

/// A chip whose instructions are tried, until one depends on more than its state.
struct Tried : translated_chip_t {
    bool is_over = false;
};

uint8_t read_effect(translated_chip_t *chip, uint16_t address) {
    static_cast<Tried *>(chip)->is_over = true;
    return chip->data[address];
}

void write_effect(translated_chip_t *chip, uint16_t address) {
    constexpr uint8_t OTHERS = static_cast<uint8_t>(~PIN_EFFECT);
    if ((chip->effects[address] & OTHERS) != 0) static_cast<Tried *>(chip)->is_over = true;
}

/// Whether the instruction may let interrupts through, or sleeps.
bool may_let_interrupts(uint16_t word) {
    constexpr uint16_t SEI = 0x9478, RETI = 0x9518, SLEEP = 0x9588, OUT = 0xB800, OUT_MASK = 0xF800;
    const auto port = static_cast<uint16_t>((word >> 5 & 0x30) | (word & 15));
    const bool writes_status = (word & OUT_MASK) == OUT && port == SREG_PORT;
    return word == SEI || word == RETI || word == SLEEP || writes_status;
}

/// Where a delay counts down in three or two registers: leaves out all turns but two.
void leave_out_turns(Tried &chip) {
    constexpr uint16_t SBIW_1 = 0x9701, SBIW_MASK = 0xFFCF, BRNE = 0xF401, BRNE_MASK = 0xFC07;
    constexpr uint16_t SUBI_1 = 0x5001, SBCI_0 = 0x4000, IMMEDIATE_MASK = 0xFF0F;
    const auto goes_back = [&](unsigned at, unsigned words) {
        const uint16_t word = flash_word(chip.flash, chip.pc + 2 * at);
        return (word & BRNE_MASK) == BRNE && (word >> 3 & 0x7F) == 0x80 - words;
    };
    const auto is = [&](unsigned at, uint16_t mask, uint16_t wanted) {
        return (flash_word(chip.flash, chip.pc + 2 * at) & mask) == wanted;
    };
    const auto count = [&](const std::array<unsigned, 3> &registers, unsigned bytes, int64_t turn) {
        uint32_t number = 0;
        for (unsigned i = 0; i < bytes; i++) number |= uint32_t{chip.data[registers[i]]} << 8 * i;
        if (number <= 2) return;
        chip.left -= (number - 2) * turn;
        for (unsigned i = 0; i < bytes; i++) chip.data[registers[i]] = i == 0 ? 2 : 0;
    };
    const uint16_t first = flash_word(chip.flash, chip.pc);
    if (is(0, SBIW_MASK, SBIW_1) && goes_back(1, 2)) {
        const unsigned low = 24 + (first >> 3 & 6);
        count({low, low + 1, 0}, 2, 4);
    } else if (is(0, IMMEDIATE_MASK, SUBI_1) && is(1, IMMEDIATE_MASK, SBCI_0) &&
               is(2, IMMEDIATE_MASK, SBCI_0) && goes_back(3, 4)) {
        std::array<unsigned, 3> registers;
        for (unsigned i = 0; i < 3; i++)
            registers[i] = 16 + (flash_word(chip.flash, chip.pc + 2 * i) >> 4 & 15);
        count(registers, 3, 5);
    }
}

}  // namespace

/// Tries on a copy what the code does meanwhile, which follows from its state alone. Interrupts may
/// be held back for longer: then this is called again.
uint64_t TranslatedRobot::held_back_until() const {
    static constexpr registers_t REGISTERS = {read_effect, write_effect};
    const bool one_waits = image_.flagged != TranslatedImage::NO_TIME;
    const bool is_held = !lets_interrupts() && image_.interrupt == Interrupt::NONE && goes_on() &&
                         image_.asleep_until == 0;
    if (!one_waits || !is_held) return 0;
    if (image_.held_back_until > cycle()) return image_.held_back_until;
    std::array<uint8_t, SRAM_END> copy = image_.data;
    std::array<uint8_t, 8> copied_flags = image_.flags;
    Tried tried = {*this};
    tried.data = copy.data();
    tried.flags = copied_flags.data();
    tried.left = MOST_CYCLES;
    const auto *const end = std::end(seam_.calls);
    int64_t tried_to = tried.left;
    for (int i = 0; i < MOST_TRIED && tried.left > 0; i++) {
        tried_to = tried.left;
        const uint16_t word = flash_word(flash, tried.pc);
        const bool is_engines = std::find(std::begin(seam_.calls), end, tried.pc) != end;
        if (is_engines || tried.pc == RETURN_FROM_MESSAGE || may_let_interrupts(word)) break;
        leave_out_turns(tried);
        if (!interpret(&tried, &REGISTERS) || tried.is_over) break;
    }
    return cycle() + static_cast<uint64_t>(MOST_CYCLES - tried_to);
}

}  // namespace kilotwin
