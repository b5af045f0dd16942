/// The bytes of one robot's SRAM that may have changed in a stretch of a run that a debugger
/// repeats: to find who wrote a variable last, it need not look at stretches in which the variable
/// has not changed.
///
/// The robot is executed by code that reports its stores (translated/watched.h), and that code
/// reports how far down it pushes; what others have changed shows where code begins and ends; of
/// known passes (passes/known_pass.h) it is known what changes in them. More bytes may be noted
/// than have changed, never fewer, but for passes that repeat up to the next tick: what these
/// change was noted when the first of them was executed, which may be in the stretch before. So a
/// search of a stretch has to look at its neighbours too.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_WRITTEN_BYTES_H
#define KILOTWIN_ROBOTS_TRANSLATED_WRITTEN_BYTES_H

#include <algorithm>
#include <bitset>
#include <cstdint>
#include <cstring>
#include <vector>

#include "base/registers.h"

namespace kilotwin {

class WrittenBytes {
  public:
    static constexpr uint16_t BEGIN = 0x100;  ///< registers, below, are not looked at
    static constexpr uint16_t END = atmega328p::SRAM_END;
    using Bytes = std::bitset<END>;

    WrittenBytes(uint32_t robot, const uint8_t *data)
        : robot_(robot),
          last_(data + BEGIN, data + END) {}

    uint32_t robot() const { return robot_; }

    /// Code is about to change a byte of SRAM.
    void stores(uint16_t address) { written_.set(address); }
    /// The program has failed: a search for what was last finds that.
    void fails() { written_.set(); }
    /// Before code begins and where it ends, with the robot's data space: what has changed since.
    /// `lowest`: the lowest address that code has pushed to meanwhile.
    void look(const uint8_t *data, uint16_t lowest = END) {
        pushed_from_ = std::min(pushed_from_, lowest);
        if (std::memcmp(last_.data(), data + BEGIN, last_.size()) == 0) return;
        for (size_t i = 0; i < last_.size(); i++)
            if (last_[i] != data[BEGIN + i]) written_.set(BEGIN + i);
        std::memcpy(last_.data(), data + BEGIN, last_.size());
    }
    /// From now on passes of a known path may be left out, with what changes in them.
    void leaves_out(const Bytes &changes) { left_out_ |= changes; }
    /// Those of the stretch that ends now; another begins.
    Bytes take(const uint8_t *data) {
        look(data);
        for (size_t at = std::max(pushed_from_, BEGIN); at < END; at++) written_.set(at);
        pushed_from_ = END;
        const Bytes out = written_ | left_out_;
        written_.reset();
        return out;
    }

  private:
    uint32_t robot_;
    std::vector<uint8_t> last_;  ///< SRAM as of the last look
    Bytes written_, left_out_;
    uint16_t pushed_from_ = END;
};

}  // namespace kilotwin

#endif
