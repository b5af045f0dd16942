#include "base/message_crc.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <iterator>

using namespace kilotwin;

namespace test_message_crc {

namespace {

struct Vector {
    uint8_t data[9];
    uint8_t type;
    uint16_t crc;
};

// Confirmed on the ATmega328P.
constexpr Vector VECTORS[] = {{{0, 0, 0, 0, 0, 0, 0, 0, 0}, 0x00, 0x9C87},
                              {{0, 0, 0, 0, 0, 0, 0, 0, 0}, 0x01, 0x8D0E},
                              {{1, 2, 3, 4, 5, 6, 7, 8, 9}, 0x02, 0x840A},
                              {{0, 0, 0, 0, 0, 0, 0, 0, 0}, 0x88, 0x94C7},
                              {{255, 255, 255, 255, 255, 255, 255, 255, 255}, 0x7F, 0x036D}};

message_t message_of(const Vector &vector) {
    message_t message;
    std::copy(std::begin(vector.data), std::end(vector.data), message.data);
    message.type = vector.type;
    message.crc = vector.crc;
    return message;
}

}  // namespace

TEST_CASE("the CRC of the vectors measured on hardware is right") {
    for (const auto &vector : VECTORS) CHECK(crc_is_right(message_of(vector)));
}

TEST_CASE("any single wrong bit is found") {
    for (const auto &vector : VECTORS)
        for (size_t bit = 0; bit < 8 * sizeof(message_t); bit++) {
            message_t message = message_of(vector);
            reinterpret_cast<uint8_t *>(&message)[bit / 8] ^= static_cast<uint8_t>(1 << bit % 8);
            CHECK_FALSE(crc_is_right(message));
        }
}

TEST_CASE("a message is twelve bytes, as on air") { CHECK(sizeof(message_t) == 12); }

TEST_CASE("whether a message is right is known anew whenever it changes, and only then") {
    CheckedMessage said;
    CHECK_FALSE(said.crc_is_right());  // nothing but zeros: its crc would be another
    for (const auto &vector : VECTORS) {
        for (int twice = 0; twice < 2; twice++) {
            said.say(message_of(vector));
            CHECK(said.crc_is_right());
            CHECK(said.message().crc == vector.crc);
        }
        message_t wrong = message_of(vector);
        wrong.data[8] ^= 1;
        said.say(wrong);
        CHECK_FALSE(said.crc_is_right());
        CHECK(said.message().data[8] == wrong.data[8]);
    }
}

}  // namespace test_message_crc
