/// Profile of a program on its chip: the deepest stack, the longest calls of chosen functions, the
/// ticks that were served.
///
/// Looks at every instruction, which makes a run several times slower. Figures are exact for the
/// code that the run has executed; they are no bound on other inputs.
#ifndef KILOTWIN_AVR_CALL_WATCH_H
#define KILOTWIN_AVR_CALL_WATCH_H

#include <cstdint>
#include <map>
#include <vector>

#include "avr/boards/robot_board.h"
#include "avr/chip/flash_image.h"
#include "avr/chip/microcontroller.h"

namespace kilotwin {

class CallWatch : public Microcontroller::Follower {
  public:
    /// Follows `board`, which runs `flash`, from its first entry into main() on. Both must live on,
    /// and nothing else may follow the board. Throws EngineError if the image has no symbol main:
    /// only ELF files have symbols.
    CallWatch(const FlashImage &flash, RobotBoard &board);

    /// Measures calls of the function at `entry`, a byte address: at most 255 functions, before the
    /// board runs. Of recursive calls the outermost counts.
    void watch(uint16_t entry);

    /// A function, and the calls of it so far.
    struct Call {
        uint16_t entry;        ///< byte address
        uint64_t calls = 0;    ///< those that go on included
        uint64_t longest = 0;  ///< cycles, interrupts included, of calls that have returned
        uint32_t tick = 0;     ///< when the longest began, see RobotBoard::tick()
        /// Byte addresses of the instructions that called it, and the tick of the first time.
        std::map<uint16_t, uint32_t> callers = {};
    };
    /// Results of the watched functions, in the order of watch().
    const std::vector<Call> &calls() const { return calls_; }

    /// Watches a sum for a carry: whether the instruction at a byte address, which ends it, leaves
    /// the carry flag as `carry` says.
    struct Sum {
        uint16_t at;
        bool carry;
        uint32_t tick = 0;  ///< of the first time; 0: it never did
    };
    /// Before the board runs.
    void watch(const Sum &sum) { sums_.emplace(sum.at, sum); }
    /// By address.
    const std::map<uint16_t, Sum> &sums() const { return sums_; }

    /// Whether the function at `entry`, one of those watched, or one that it has called, is
    /// running.
    bool inside(uint16_t entry) const;

    /// Bytes of the stack at its deepest, and the byte address of the instruction that grew it
    /// there.
    uint16_t deepest() const { return static_cast<uint16_t>(RAM_END - least_sp_); }
    uint16_t deepest_at() const { return deepest_at_; }

    /// Bytes left between the variables (or the heap, as far as malloc() has taken it) and the
    /// deepest stack; negative: they overlap.
    int32_t room() const { return room_; }

    /// Interrupts of timer 0's compare match that were served.
    uint64_t ticks() const { return ticks_; }

    /// Called by the chip (Microcontroller::Follower).
    void executed(uint32_t from, uint32_t pc, uint16_t sp) override;

  private:
    static constexpr uint16_t RAM_END = 0x8FF;
    static constexpr uint8_t NOT_WATCHED = 0xFF;
    /// A call that has not returned yet.
    struct Open {
        uint8_t which;   ///< index into calls_
        uint16_t sp;     ///< stack pointer when it began
        uint64_t since;  ///< cycle
        uint32_t tick;
    };

    void record_stack(uint32_t from, uint16_t sp);
    void look_at_sum(uint32_t from);

    const FlashImage &flash_;
    RobotBoard &board_;
    std::vector<uint8_t> which_;  ///< index into calls_, by word address
    std::vector<Call> calls_;
    std::vector<Open> open_;
    std::map<uint16_t, Sum> sums_;
    uint16_t main_, data_end_;
    uint16_t heap_end_at_;  ///< address of __brkval; 0: the program has no heap
    uint16_t least_sp_ = RAM_END, deepest_at_ = 0;
    int32_t room_ = RAM_END;
    uint64_t ticks_ = 0;
    bool in_main_ = false;   ///< main() has been entered
    bool half_set_ = false;  ///< one half of a new stack pointer is written
};

}  // namespace kilotwin

#endif
