/// A robot on the bench whose flash holds the boot loader, and senders of images.
#ifndef KILOTWIN_TESTS_BOOTLOADER_ROBOT_H
#define KILOTWIN_TESTS_BOOTLOADER_ROBOT_H

#include <functional>
#include <optional>

#include "../kilolib/bench.h"
#include "image.h"

namespace kilotwin {

constexpr uint8_t RED = 0x03, GREEN = 0x0C, BLUE = 0x30, YELLOW = 0x0F;
constexpr uint16_t UID = 0x1234;
/// A frame as it is on air, and from one to the next when frames go out back to back.
constexpr Cycles FRAME = 130 * SLOT, BACK_TO_BACK = FRAME + 2 * SLOT;
/// From packet to packet of KiloGUI, and from frame to frame of a repeated message.
constexpr Cycles PACKET = 130 * MS, REPEAT = 10'400 * MS / 1000;

/// A robot with `flash`, and light that is sent to it. Every frame may be lost on its way.
class FlashedRobot {
  public:
    explicit FlashedRobot(const Flash &flash);

    /// Sends a frame, `spacing` after the begin of the one before it.
    void send(const message_t &message, Cycles spacing);
    /// Sends a message again and again for a time.
    void repeat(const message_t &message, double ms);
    void send_page(const Image &image, uint8_t page, Cycles spacing);

    /// Queries until an answer comes, at most a few times, and returns it.
    std::optional<message_t> ask(uint8_t first, uint8_t slots = 2);

    void run_ms(double ms) { advance(bench.board.now() + static_cast<Cycles>(ms * double(MS))); }
    /// The loader waits or loads: no application is at work.
    bool in_loader();
    /// Sends RUN and returns the LED's colour then.
    uint8_t color_after_run();
    bool has(const Image &image) const { return image.is_in(bench.board.flash_content()); }

    Bench bench;
    std::function<bool()> is_lost = [] { return false; };
    /// Called while time passes, often enough to see each flash operation by itself.
    std::function<void()> watch;

  private:
    void advance(Cycles until);
    Cycles next_ = 0;  ///< begin of the next frame, at the earliest
};

}  // namespace kilotwin

#endif
