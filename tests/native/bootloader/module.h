/// A module's board whose flash holds the boot loader, and senders of images by CAN.
#ifndef KILOTWIN_TESTS_BOOTLOADER_MODULE_H
#define KILOTWIN_TESTS_BOOTLOADER_MODULE_H

#include <functional>
#include <optional>
#include <vector>

#include "avr/boards/module_board.h"
#include "image.h"

namespace kilotwin {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
constexpr uint8_t X = 3, Y = 7;
constexpr uint16_t ALL = 0, ROW = (Y + 1) << 6, COLUMN = (X + 1) << 1, OWN = ROW | COLUMN;
constexpr uint8_t BLUE = 4, GREEN = 2;

/// Types of hardware.md 3.2; deployed boot loaders have those of pages, and MODULE_IDLE, OLDER
/// higher.
enum : uint8_t {
    MODULE_BOOT = 0x06,
    MODULE_BOOTPAGE,
    MODULE_BOOTPAGE_SIZE,
    MODULE_BOOTPAGE_NUMBER,
    MODULE_IDLE = 0x0B,
    MODULE_SETUP,
    MODULE_RUN,
    BOOTPAGE_CRC = 0x16,
    BOOT_QUERY,
    BOOT_REPORT,
    OLDER = 0x9F,
};

class FlashedModule {
  public:
    /// `free_bus_after`: how long the bus keeps each of its frames waiting.
    explicit FlashedModule(const Flash &flash, uint8_t x = X, uint8_t y = Y,
                           Cycles free_bus_after = 0);

    /// Sends a frame of eight bytes, `spacing` after the one before it.
    void send(uint8_t type, std::vector<uint8_t> data, Cycles spacing = MS, uint16_t id = ALL);
    void announce(const Image &image, bool checked, uint8_t older = 0);
    /// The number of a page and its 22 chunks.
    void send_page(const Image &image, uint8_t page, Cycles spacing = MS, uint8_t older = 0);

    /// Sends a question, and returns the data of the answer, if one comes within 10 ms.
    std::optional<std::array<uint8_t, 8>> ask(uint8_t first, uint16_t id = OWN);

    void run_ms(double ms) { advance(board.now() + static_cast<Cycles>(ms * double(MS))); }
    /// Its byte on the serial line within 30 ms; 0: none.
    char says();
    bool has(const Image &image) const { return image.is_in(board.flash_content()); }

    Chance chance{1};
    ModuleBoard board;
    std::vector<CanOutput> sent;
    std::function<bool()> is_lost = [] { return false; };
    /// Called while time passes, often enough to see each flash operation by itself.
    std::function<void()> watch;

  private:
    void advance(Cycles until);

    Cycles next_ = 0;  ///< end of the next frame, at the earliest
    Cycles free_bus_after_;
};

}  // namespace kilotwin

#endif
