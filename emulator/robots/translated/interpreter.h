/// Interpreter of a guest's machine code, for what its translation leaves: registers with an
/// effect, addresses outside of SRAM, the ends of interrupts, and code that no symbol, table or
/// jump leads to. The effects of instructions are those of translated/code.h.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_INTERPRETER_H
#define KILOTWIN_ROBOTS_TRANSLATED_INTERPRETER_H

#include <stdbool.h>

#include "robots/translated/code.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Accesses to registers with an effect, by data address below 0x100; at that moment `chip->left`
/// is that of the instruction's begin.
typedef struct {
    uint8_t (*read)(translated_chip_t *chip, uint16_t address);
    void (*written)(translated_chip_t *chip, uint16_t address);  ///< the byte is there
} registers_t;

/// Executes the instruction at chip->pc. False where the chip has no such instruction: then nothing
/// has changed. sleep, break, wdr and spm do nothing but take their cycles.
bool interpret(translated_chip_t *chip, const registers_t *registers);

/// First word of the instruction at a byte address; addresses wrap at the flash's end.
static inline uint16_t flash_word(const uint8_t *flash, uint32_t address) {
    return (uint16_t)(flash[address & 0x7FFE] | flash[(address & 0x7FFE) + 1] << 8);
}

#ifdef __cplusplus
}
#endif

#endif
