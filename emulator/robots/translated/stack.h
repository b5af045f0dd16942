/// The stack of a translated robot, while the engine does to it what interrupts and calls do: of
/// the robot's code `push`, `pop` and `ret` are its own (translated/code.h).
#ifndef KILOTWIN_ROBOTS_TRANSLATED_STACK_H
#define KILOTWIN_ROBOTS_TRANSLATED_STACK_H

#include <cstdint>

#include "base/registers.h"

namespace kilotwin {

/// Its pointer is kept from the first byte to the last, and goes back to its registers at the end:
/// nineteen bytes are pushed for each message. These are, from the top down: where the program goes
/// on; r0, r1 and the registers that functions may change; the status register; where the callback
/// returns to.
///
/// Behind SRAM there is nothing: what is pushed there is lost, and 0 comes back.
class TranslatedStack {
  public:
    /// `data`: the data space, of which nothing else may change the pointer meanwhile.
    explicit TranslatedStack(uint8_t *data)
        : data_(data),
          next_(static_cast<uint16_t>(data[atmega328p::SPL] | data[atmega328p::SPH] << 8)) {}
    TranslatedStack(const TranslatedStack &) = delete;
    TranslatedStack &operator=(const TranslatedStack &) = delete;
    ~TranslatedStack() {
        data_[atmega328p::SPL] = static_cast<uint8_t>(next_);
        data_[atmega328p::SPH] = static_cast<uint8_t>(next_ >> 8);
    }

    /// A byte, to where the pointer is; that goes down.
    void push(uint8_t value) {
        if (next_ < atmega328p::SRAM_END) data_[next_] = value;
        next_--;
    }
    /// The byte that was pushed last.
    uint8_t pop() {
        next_++;
        return next_ < atmega328p::SRAM_END ? data_[next_] : 0;
    }

    /// Where code goes on, as a byte address; the chip keeps that of the word, low byte first.
    void push_return(uint32_t pc) {
        push(static_cast<uint8_t>(pc / 2));
        push(static_cast<uint8_t>(pc / 2 >> 8));
    }
    /// As `ret` takes it.
    uint32_t pop_return() {
        const uint32_t high = pop();
        return (high << 8 | pop()) * 2;
    }

  private:
    uint8_t *data_;
    uint16_t next_;  ///< the next free byte
};

}  // namespace kilotwin

#endif
