/// Executes a chip's machine code as C code that was made from it and compiled, in place of
/// simavr's interpreter; simavr's peripherals, timers and interrupts stay.
///
/// The rest is left to the interpreter, instruction by instruction: accesses to registers that have
/// an effect, what an interrupt's begin and end need, self-programming, and code that is no longer
/// what was translated.
#ifndef KILOTWIN_AVR_CHIP_TRANSLATED_CORE_H
#define KILOTWIN_AVR_CHIP_TRANSLATED_CORE_H

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "robots/translated/code.h"

struct avr_t;

namespace kilotwin {

/// Loads a shared object that the host has made of a flash (host_tools/kilotwin/build/
/// translation.py); it stays for as long as the process. EngineError if it cannot be loaded or was
/// made for another version of the engine.
const translation_t &load_translation(const std::string &path);

/// One per chip.
class TranslatedCore {
  public:
    /// `avr` and `translation` must live on; the chip's flash is what was translated.
    TranslatedCore(avr_t *avr, const translation_t &translation);

    /// Executes from the chip's program counter on, up to the first instruction at or after cycle
    /// `until`, and no interrupt may be waiting. Returns the cycles that the interpreter has to
    /// execute next: 0 if `until` is reached, 1 for one instruction, else all that are left.
    uint64_t run(uint64_t until);

    /// To be called when simavr's handlers of registers have changed.
    void find_effects();

    /// To be called when the flash has changed, as the program sees it: regions whose code is not
    /// what was translated are interpreted until it is again. Costs a comparison of all code.
    void compare_flash();

  private:
    avr_t *avr_;
    const translation_t &translation_;
    const translated_region_t *code_;  ///< by region: the translation's, or own_
    std::vector<translated_region_t> own_;
    std::array<uint8_t, 0x100> effects_{};
};

}  // namespace kilotwin

#endif
