/// Self-programming of the ATmega328P's flash (datasheet, chapter 27).
///
/// Stands in for simavr's, which erases and writes at once, and replaces what was there. Modelled:
/// SPM within four cycles of its announcement, and only from the boot section; the buffer of a
/// page, each word of which takes one value until it is cleared; a write that only clears bits; the
/// 4 ms of an erase or a write, in which the part below the boot section cannot be read (it reads
/// as erased, so a program that goes on there slides away) until it is enabled again; the processor
/// that stands still when the boot section itself is programmed. Not modelled: lock bits, fuses,
/// signature, the interrupt of SPM.
#ifndef KILOTWIN_AVR_CHIP_SELF_PROGRAMMING_H
#define KILOTWIN_AVR_CHIP_SELF_PROGRAMMING_H

#include <array>
#include <cstdint>

#include "base/registers.h"

struct avr_t;

namespace kilotwin {

/// One per chip. Times are the chip's cycles.
class SelfProgramming {
  public:
    static constexpr uint32_t PAGE_BYTES = 128;
    /// Duration of an erase or a write: 4 ms; the datasheet says 3.7 to 4.5.
    static constexpr uint64_t OPERATION_CYCLES = 32'000;

    /// Takes SPMCSR and the SPM instruction over. `avr` must live on, and its flash be loaded.
    SelfProgramming(avr_t *avr, uint32_t boot_section);

    /// The program executes SPM.
    void execute();

    /// The chip was reset: an operation under way is not done.
    void was_reset();

    /// A byte of the flash as it is, whether the program could read it now or not.
    uint8_t content(uint16_t address) const { return content_[address]; }
    const std::array<uint8_t, atmega328p::FLASH_BYTES> &content() const { return content_; }

    /// Counts the changes of what the program can read and execute.
    uint32_t changes() const { return changes_; }

    /// Erases and writes that are done, since power-up.
    uint32_t operations() const { return operations_; }

  private:
    struct Hooks;
    void control_written(uint8_t value);
    void begin(uint32_t page, bool writes);
    void operation_ends();
    void hide(bool hidden);
    void clear_buffer();
    uint8_t &control() const;

    avr_t *avr_;
    uint32_t boot_section_;
    std::array<uint8_t, atmega328p::FLASH_BYTES> content_;
    std::array<uint8_t, PAGE_BYTES> buffer_;
    std::array<bool, PAGE_BYTES / 2> filled_{};  ///< words of the buffer that have a value
    uint64_t announced_until_ = 0;               ///< SPM counts up to this cycle
    uint32_t page_ = 0;                          ///< address of the one that is programmed
    bool busy_ = false, writes_ = false;
    uint32_t operations_ = 0, changes_ = 0;
};

}  // namespace kilotwin

#endif
