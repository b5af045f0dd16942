// Messages as pulses of light, and pulses as messages.
#include <doctest/doctest.h>

#include <cstring>

#include "infrared/infrared_pulses.h"

using namespace kilotwin;

namespace test_infrared_pulses {

using Found = PulseReader::Found;

namespace {

message_t message_of(uint8_t first) {
    message_t message = {};
    for (uint8_t i = 0; i < 9; i++) message.data[i] = static_cast<uint8_t>(first * (i + 1));
    message.type = static_cast<decltype(message.type)>(0x55);
    message.crc = 0x8001;
    return message;
}

/// The reader's result at the last of the pulses.
Found read(PulseReader &reader, const std::vector<Cycles> &pulses, Cycles from) {
    Found found = Found::NOTHING;
    for (Cycles pulse : pulses) found = reader.pulse(from + pulse);
    return found;
}

}  // namespace

TEST_CASE("a frame is a leader and twelve bytes in slots of 269 cycles") {
    message_t message = {};
    message.data[0] = 0x05;
    const auto pulses = pulses_of(message);
    REQUIRE(pulses.size() == 13 * 2 + 2);
    CHECK(pulses[0] == 0);
    CHECK(pulses[1] == 9 * 269);
    CHECK(pulses[2] == 10 * 269);
    CHECK(pulses[3] == 11 * 269);  // bit 0
    CHECK(pulses[4] == 13 * 269);  // bit 2
    CHECK(pulses[5] == 19 * 269);
    CHECK(pulses.back() == 129 * 269);
    CHECK(pulses.back() < FRAME_CYCLES);
}

TEST_CASE("what is sent is read, also by a clock that is 4 % off") {
    for (uint8_t first : {0, 1, 85, 255})
        for (Cycles clock : {96, 100, 104}) {
            const message_t message = message_of(first);
            auto pulses = pulses_of(message);
            for (Cycles &pulse : pulses) pulse = pulse * clock / 100;
            PulseReader reader;
            CHECK(reader.pulse(1000) == Found::BEGIN);
            CHECK(reader.reading());
            for (size_t i = 1; i + 1 < pulses.size(); i++)
                CHECK(reader.pulse(1000 + pulses[i]) == Found::NOTHING);
            CHECK(reader.pulse(1000 + pulses.back()) == Found::MESSAGE);
            CHECK_FALSE(reader.reading());
            CHECK(reader.begun_at() == 1000);
            CHECK(std::memcmp(&reader.message(), &message, sizeof message) == 0);
        }
}

TEST_CASE("an attempt that is given up is over after a silence, and the next frame is read") {
    PulseReader reader;
    CHECK(reader.pulse(500) == Found::BEGIN);
    CHECK_FALSE(reader.torn_off(500 + 2958));
    CHECK(reader.torn_off(500 + 2959));
    CHECK(read(reader, pulses_of(message_of(3)), 5000) == Found::MESSAGE);
    CHECK_FALSE(reader.torn_off(1'000'000));
}

TEST_CASE("a leader that is not 0 and a pulse out of place are no frame") {
    PulseReader reader;
    reader.pulse(0);
    CHECK(reader.pulse(3 * 269) == Found::NOTHING);
    CHECK(reader.pulse(9 * 269) == Found::NONSENSE);
    reader.pulse(100'000);
    CHECK(reader.pulse(100'010) == Found::NONSENSE);
    reader.pulse(200'000);
    CHECK(reader.pulse(200'000 + 2650) == Found::NONSENSE);
    CHECK(read(reader, pulses_of(message_of(3)), 300'000) == Found::MESSAGE);
}

}  // namespace test_infrared_pulses
