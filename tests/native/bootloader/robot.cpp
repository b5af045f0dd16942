#include "robot.h"

#include <algorithm>

namespace kilotwin {

namespace {

// Time between two looks at the robot: less than an erase or a write takes.
constexpr Cycles LOOK = 2 * MS;

}  // namespace

FlashedRobot::FlashedRobot(const Flash &flash) : bench(FlashImage::of(flash, "robot"), UID) {}

void FlashedRobot::advance(Cycles until) {
    // A board that idles may stay a little behind.
    for (Cycles at = bench.board.now(); at < until;) {
        at = watch ? std::min(until, at + LOOK) : until;
        bench.board.run(at);
        if (watch) watch();
    }
}

void FlashedRobot::send(const message_t &message, Cycles spacing) {
    next_ = std::max(next_, bench.board.now() + 100);
    if (!is_lost()) bench.shine_frame(next_, message, {300, 600});
    next_ += spacing;
    advance(next_ - 100);
}

void FlashedRobot::repeat(const message_t &message, double ms) {
    const Cycles until = bench.board.now() + static_cast<Cycles>(ms * double(MS));
    while (bench.board.now() + REPEAT < until) send(message, REPEAT);
    advance(until);
}

void FlashedRobot::send_page(const Image &image, uint8_t page, Cycles spacing) {
    for (uint8_t offset = 0; offset < 64; offset = static_cast<uint8_t>(offset + 3)) {
        std::vector<uint8_t> data = {page, offset};
        const size_t at = page * size_t{128} + offset * size_t{2};
        // The last frame of a page carries what follows it, or what the sender's memory has.
        for (size_t i = at; i < at + 6; i++)
            data.push_back(i < image.bytes.size() ? image.bytes[i] : 0x5A);
        send(make_message(BOOTPGM_PAGE, data), spacing);
    }
}

std::optional<message_t> FlashedRobot::ask(uint8_t first, uint8_t slots) {
    for (uint8_t nonce = 0; nonce < 8; nonce++) {
        bench.board.outputs.clear();
        send(make_message(0x8C, {first, slots, nonce, 0xFF, 0xFF}), BACK_TO_BACK);
        advance(bench.board.now() + (Cycles{1} << slots) * 15 * MS + 10 * MS);
        const auto frames = frames_of(bench.board.outputs.light);
        if (frames.size() == 1 && frames[0].crc_is_right) return frames[0].message;
    }
    return std::nullopt;
}

// It blinks blue for 5 ms each second, or shows blue or green all the time; a program of kilolib
// that waits blinks green for 1 ms each 201 ms.
bool FlashedRobot::in_loader() {
    bench.board.outputs.clear();
    run_ms(1100);
    const auto &colors = bench.board.outputs.colors;
    size_t blue = 0, green = 0;
    for (const auto &color : colors) {
        blue += color.rgb == BLUE;
        green += color.rgb == GREEN;
    }
    return green == 0 && (blue == 1 || blue == 2 || bench.board.color() != 0);
}

uint8_t FlashedRobot::color_after_run() {
    send(make_message(RUN), BACK_TO_BACK);
    run_ms(30);
    send(make_message(RUN), BACK_TO_BACK);
    run_ms(30);
    return bench.board.color();
}

}  // namespace kilotwin
