#include "module.h"

#include <algorithm>
#include <utility>

namespace kilotwin {

namespace {

// Time between two looks at the board: less than an erase or a write takes.
constexpr Cycles LOOK = MS;
constexpr Cycles FRAME = MS * 3 / 10;
constexpr size_t CHUNK = 6, CHUNKS = 22, PAGE = 128;

}  // namespace

FlashedModule::FlashedModule(const Flash &flash, uint8_t x, uint8_t y, Cycles free_bus_after)
    : board(*FlashImage::of(flash, "module"), 0, ModuleBoard::eeprom_of(x, y), TICK_CYCLES, 0,
            chance),
      free_bus_after_(free_bus_after) {}

void FlashedModule::advance(Cycles until) {
    // A board that idles may stay a little behind.
    for (Cycles at = board.now(); at < until;) {
        at = std::min(until, at + LOOK);
        board.run(at);
        for (const auto &output : std::exchange(board.can_frames, {})) {
            sent.push_back(output);
            board.frame_sent(std::max(output.at + FRAME + free_bus_after_, board.now()));
        }
        if (watch) watch();
    }
}

void FlashedModule::send(uint8_t type, std::vector<uint8_t> data, Cycles spacing, uint16_t id) {
    CanFrame frame;
    frame.id = id;
    frame.dlc = 8;
    frame.data[0] = type;
    std::copy(data.begin(), data.end(), frame.data.begin() + 1);
    next_ = std::max(next_, board.now() + FRAME);
    if (!is_lost()) board.receive_can(next_, frame);
    advance(next_);
    next_ += spacing;
}

void FlashedModule::announce(const Image &image, bool checked, uint8_t older) {
    const auto type = static_cast<uint8_t>(MODULE_BOOTPAGE_SIZE + older);
    if (checked) {
        std::vector<uint8_t> check = {1, static_cast<uint8_t>(image.crc()),
                                      static_cast<uint8_t>(image.crc() >> 8)};
        check.insert(check.end(), image.id.begin(), image.id.end());
        send(type, check);
    }
    send(type, {0, image.pages()});
}

void FlashedModule::send_page(const Image &image, uint8_t page, Cycles spacing, uint8_t older) {
    send(static_cast<uint8_t>(MODULE_BOOTPAGE_NUMBER + older), {0, page}, spacing);
    for (size_t chunk = 0; chunk < CHUNKS; chunk++) {
        std::vector<uint8_t> data = {static_cast<uint8_t>(chunk)};
        const size_t at = page * PAGE + chunk * CHUNK;
        // The last chunk carries what follows the page, or what the sender's memory has.
        for (size_t i = at; i < at + CHUNK; i++)
            data.push_back(i < image.bytes.size() ? image.bytes[i] : 0x5A);
        send(static_cast<uint8_t>(MODULE_BOOTPAGE + older), data, spacing);
    }
}

std::optional<std::array<uint8_t, 8>> FlashedModule::ask(uint8_t first, uint16_t id) {
    sent.clear();
    send(BOOT_QUERY, {first}, MS, id);
    run_ms(10);
    if (sent.size() != 1 || sent[0].frame.id != (OWN | 1) || sent[0].frame.dlc != 8)
        return std::nullopt;
    return sent[0].frame.data;
}

char FlashedModule::says() {
    board.serial.clear();
    run_ms(30);
    return board.serial.empty() ? '\0' : static_cast<char>(board.serial.back().byte);
}

}  // namespace kilotwin
