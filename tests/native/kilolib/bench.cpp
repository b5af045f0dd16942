#include "bench.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <utility>

namespace kilotwin {

namespace {

std::shared_ptr<const FlashImage> load(const std::string &program) {
    if (program.find('/') != std::string::npos) return FlashImage::load(program);
    return FlashImage::load(PROGRAMS "/" + program + ".elf");
}

// Bit by bit, as the CRC is defined: the runtime has another way.
uint16_t crc_of(const message_t &message) {
    const auto *bytes = reinterpret_cast<const uint8_t *>(&message);
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < offsetof(message_t, crc); i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = static_cast<uint16_t>(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}

bool shines(const std::vector<Cycles> &pulses, Cycles at) {
    for (Cycles pulse : pulses)
        if (pulse == at) return true;
    return false;
}

}  // namespace

message_t make_message(uint8_t type, std::vector<uint8_t> data) {
    message_t message{};
    std::copy(data.begin(), data.end(), message.data);
    message.type = type;
    message.crc = crc_of(message);
    return message;
}

// A board's clock jitters by nothing, so every pulse has to be where its slot begins, to the cycle.
std::vector<Frame> frames_of(const std::vector<BoardOutputs::Light> &light) {
    std::vector<Cycles> pulses;
    for (const auto &edge : light)
        if (edge.on) pulses.push_back(edge.at);
    std::vector<Frame> frames;
    size_t next = 0;
    while (next < pulses.size()) {
        const Cycles begin = pulses[next];
        constexpr Cycles LAST_SLOT = 129;
        Frame frame{begin, begin + LAST_SLOT * SLOT, {}, false};
        REQUIRE(shines(pulses, begin + 9 * SLOT));
        size_t count = 2;
        uint8_t bytes[sizeof(message_t)] = {};
        for (Cycles byte = 1; byte <= sizeof bytes; byte++) {
            const Cycles start = begin + 10 * byte * SLOT;
            REQUIRE(shines(pulses, start));
            REQUIRE(shines(pulses, start + 9 * SLOT));
            count += 2;
            for (Cycles bit = 0; bit < 8; bit++) {
                if (!shines(pulses, start + (1 + bit) * SLOT)) continue;
                bytes[byte - 1] = static_cast<uint8_t>(bytes[byte - 1] | 1 << bit);
                count++;
            }
        }
        std::memcpy(&frame.message, bytes, sizeof bytes);
        frame.crc_is_right = crc_of(frame.message) == frame.message.crc;
        next += count;
        REQUIRE(pulses[next - 1] == frame.end);
        frames.push_back(frame);
    }
    return frames;
}

Bench::Bench(const std::string &program, uint16_t uid, Cycles power_up)
    : Bench(load(program), uid, power_up) {}

Bench::Bench(std::shared_ptr<const FlashImage> image, uint16_t uid, Cycles power_up)
    : flash(std::move(image)),
      calibration{TICK_CYCLES, uid, 61, 62, 63, 64, InfraredGains()},
      board(*flash, 0, calibration, power_up, chance) {}

void Bench::shine_frame(Cycles at, const message_t &message, distance_measurement_t strength,
                        Cycles slot) {
    uint8_t bytes[1 + sizeof message] = {};
    std::memcpy(bytes + 1, &message, sizeof message);
    for (Cycles byte = 0; byte < sizeof bytes; byte++) {
        const unsigned slots = 1u | static_cast<unsigned>(bytes[byte]) << 1 | 1u << 9;
        for (Cycles s = 0; s < 10; s++) {
            if ((slots >> s & 1) == 0) continue;
            const Cycles begin = at + (10 * byte + s) * slot;
            board.shine({begin, begin + RobotBoard::SEEN_PULSE, strength});
        }
    }
}

void Bench::hear(const message_t &message, distance_measurement_t strength) {
    shine_frame(board.now() + 100, message, strength);
    run_ms(5);
}

void Bench::start() {
    run_ms(20);
    hear(make_message(RUN));
    run_ms(12);  // an idle robot looks each 10 ms
    REQUIRE(board.failure() == "");
    REQUIRE(state() == ROBOT_RUNNING);
}

int16_t Bench::ask(Request request, uint16_t argument) {
    set("argument", argument, 2);
    set("request", request, 1);
    for (int i = 0; i < 5000 && byte("request") != 0; i++) run_ms(0.1);
    REQUIRE(byte("request") == 0);
    return static_cast<int16_t>(word("result", 2));
}

uint16_t Bench::address(const std::string &symbol) const {
    auto found = flash->symbol(symbol);
    REQUIRE_MESSAGE(found.has_value(), "the program has no ", symbol);
    return *found;
}

uint32_t Bench::word(const std::string &symbol, int bytes) const {
    const uint16_t at = address(symbol);
    uint32_t value = 0;
    for (int i = 0; i < bytes; i++)
        value |= static_cast<uint32_t>(board.read(static_cast<uint16_t>(at + i))) << 8 * i;
    return value;
}

void Bench::set(const std::string &symbol, uint32_t value, int bytes) {
    const uint16_t at = address(symbol);
    for (int i = 0; i < bytes; i++)
        board.write(static_cast<uint16_t>(at + i), static_cast<uint8_t>(value >> 8 * i));
}

}  // namespace kilotwin
