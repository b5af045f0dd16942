/// What a program takes of its chip while it runs: the stack at its deepest, cycles of some functions' longest calls,
/// ticks.
#ifndef KILOTWIN_AVR_CHIP_CALL_WATCH_H
#define KILOTWIN_AVR_CHIP_CALL_WATCH_H

#include <cstdint>
#include <vector>

#include "avr/boards/robot_board.h"
#include "avr/chip/flash_image.h"
#include "avr/chip/microcontroller.h"

namespace kilotwin {

class CallWatch : public Microcontroller::Follower {
  public:
    /// Begins to look when `board`, which runs `flash`, enters main(). Throws EngineError if the image does not say
    /// where that is: only ELF files do. Both must live on.
    CallWatch(const FlashImage &flash, RobotBoard &board);

    /// Measures calls of the function at `entry`, a byte address. Of calls within a call the outermost counts.
    void watch(uint16_t entry);

    struct Call {
        uint16_t entry;
        uint64_t calls = 0;
        uint64_t longest = 0;  ///< cycles, interrupts included, of those that came back
        uint32_t tick = 0;     ///< when the longest began, see RobotBoard::tick()
    };
    const std::vector<Call> &calls() const { return calls_; }

    /// Whether the function at `entry`, one of those watched, is being executed.
    bool inside(uint16_t entry) const;

    /// Bytes of the stack at its deepest, and where the program counter was then.
    uint16_t deepest() const { return static_cast<uint16_t>(RAM_END - least_sp_); }
    uint16_t deepest_at() const { return deepest_at_; }

    /// Bytes between variables, or what malloc() took, and the stack at its deepest; below 0: it lies on them.
    int32_t room() const { return room_; }

    /// Interrupts of timer 0's compare match: those that were served.
    uint64_t ticks() const { return ticks_; }

    void executed(uint32_t from, uint32_t pc, uint16_t sp) override;

  private:
    static constexpr uint16_t RAM_END = 0x8FF;
    static constexpr uint8_t NOT_WATCHED = 0xFF;
    struct Open {
        uint8_t which;
        uint16_t sp;
        uint64_t since;
        uint32_t tick;
    };

    void look_at_stack(uint32_t from, uint16_t sp);

    const FlashImage &flash_;
    RobotBoard &board_;
    std::vector<uint8_t> which_;  ///< by word address
    std::vector<Call> calls_;
    std::vector<Open> open_;
    uint16_t main_, data_end_, heap_end_at_;
    uint16_t least_sp_ = RAM_END, deepest_at_ = 0;
    int32_t room_ = RAM_END;
    uint64_t ticks_ = 0;
    bool in_main_ = false, half_set_ = false;
};

}  // namespace kilotwin

#endif
