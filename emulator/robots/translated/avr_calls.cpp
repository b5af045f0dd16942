#include "robots/translated/avr_calls.h"

#include "base/registers.h"
#include "robots/translated/interpreter.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

/// Whether the instruction before a byte address of flash is a call.
bool follows_call(const uint8_t *flash, uint32_t address) {
    constexpr uint16_t ICALL = 0x9509, RCALL = 0xD000, CALL = 0x940E;
    if (address < 2) return false;
    const uint16_t before = flash_word(flash, address - 2);
    if (before == ICALL || (before & 0xF000) == RCALL) return true;
    return address >= 4 && (flash_word(flash, address - 4) & 0xFE0E) == CALL;
}

}  // namespace

// The high byte of an address lies below the low one, and it counts in words. The line of a call
// has its last word.
CodePath avr_code_path(uint32_t pc, const uint8_t *data, const uint8_t *flash) {
    constexpr size_t MOST = 16;
    CodePath code = {pc};
    for (uint32_t at = (data[SPH] << 8 | data[SPL]) + 1u; at + 1 < SRAM_END && code.size() < MOST;
         at++) {
        const uint32_t back = 2u * static_cast<uint32_t>(data[at] << 8 | data[at + 1]);
        if (back < FLASH_BYTES && follows_call(flash, back)) code.push_back(back - 2);
    }
    return code;
}

}  // namespace kilotwin
