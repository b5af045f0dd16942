// The programmer's protocol, message by message, and whatever else may come in on its line.
#include <doctest/doctest.h>

#include <numeric>

#include "avr/boards/stk500v2.h"

using namespace kilotwin;

namespace test_stk500v2 {

namespace {

using Message = Stk500v2::Message;

/// A message as the PC sends it.
Message framed(const Message &body, uint8_t sequence = 1, uint8_t wrong = 0) {
    Message message = {0x1B, sequence, static_cast<uint8_t>(body.size() >> 8),
                       static_cast<uint8_t>(body.size()), 0x0E};
    message.insert(message.end(), body.begin(), body.end());
    message.push_back(wrong ^ std::accumulate(message.begin(), message.end(), uint8_t{0},
                                              [](uint8_t a, uint8_t b) { return a ^ b; }));
    return message;
}

/// A programmer and its chip, with a PC.
struct Bench {
    ChipMemory memory;
    Stk500v2 programmer{memory};

    /// The body of the answer; its frame is checked here.
    Message ask(const Message &body, uint8_t sequence = 1) {
        const Message answer = programmer.receive(framed(body, sequence));
        REQUIRE(answer.size() > 6);
        const Message inside(answer.begin() + 5, answer.end() - 1);
        CHECK(answer == framed(inside, sequence));
        return inside;
    }
    Message enter() { return ask({0x10, 200, 100, 25, 32, 0, 0x53, 3, 0xAC, 0x53, 0, 0}); }
    void address(uint32_t at) {
        auto part = [&](int shift) { return static_cast<uint8_t>(at >> shift); };
        CHECK(ask({0x06, part(24), part(16), part(8), part(0)}) == Message{0x06, 0});
    }
    /// PROGRAM_FLASH or PROGRAM_EEPROM.
    Message write(uint8_t command, uint8_t mode, uint8_t load, uint8_t page, const Message &data) {
        Message body = {command, 0,   static_cast<uint8_t>(data.size()), mode, 10, load, page, 0,
                        0xFF,    0xFF};
        body.insert(body.end(), data.begin(), data.end());
        return ask(body);
    }
};

}  // namespace

TEST_CASE("it says who it is, with the PC's sequence number") {
    Bench bench;
    Message hello = bench.ask({0x01}, 77);
    CHECK(Message(hello.begin(), hello.begin() + 3) == Message{0x01, 0, 8});
    CHECK(std::string(hello.begin() + 3, hello.end()) == "AVRISP_2");
}

TEST_CASE("messages may come in pieces, several at once, and after noise") {
    Bench bench;
    Message bytes = {0xFF, 0x00, 0x55};
    for (int i = 0; i < 2; i++) {
        const Message hello = framed({0x01});
        bytes.insert(bytes.end(), hello.begin(), hello.end());
    }
    Message answers;
    for (uint8_t byte : bytes) {
        const Message some = bench.programmer.receive({&byte, 1});
        answers.insert(answers.end(), some.begin(), some.end());
    }
    CHECK(answers.size() == 2 * (6 + 11));
    CHECK(bench.programmer.receive(bytes) == answers);
}

TEST_CASE("what is no message is passed over, and the next one is answered") {
    for (const Message &noise : {Message{0x1B, 1, 0, 0},         // no body
                                 Message{0x1B, 1, 1, 20},        // 276 bytes
                                 Message{0x1B, 1, 0, 1, 0x99}})  // no token
    {
        Bench bench;
        CHECK(bench.programmer.receive(noise).empty());
        bench.ask({0x01});
    }
}

TEST_CASE("a wrong checksum is answered as such, and the command is not done") {
    Bench bench;
    bench.enter();
    bench.memory.flash[0] = 7;
    const Message erase = {0x12, 55, 1, 0xAC, 0x80, 0, 0};
    CHECK(bench.programmer.receive(framed(erase, 9, 0x40)) == framed({0xB0, 0xC1}, 9));
    CHECK(bench.memory.flash[0] == 7);
    CHECK(bench.ask(erase) == Message{0x12, 0});
    CHECK(bench.memory.flash[0] == 0xFF);
}

TEST_CASE("a line that hangs up in mid-message leaves no half message and releases the chip") {
    Bench bench;
    bench.enter();
    const Message hello = framed({0x01});
    bench.programmer.receive({hello.data(), 4});
    bench.programmer.hang_up();
    CHECK_FALSE(bench.programmer.programming());
    bench.ask({0x01});
}

TEST_CASE("parameters are those of an AVRISP; unknown ones fail") {
    Bench bench;
    CHECK(bench.ask({0x03, 0x91}) == Message{0x03, 0, 2});
    CHECK(bench.ask({0x03, 0x77}) == Message{0x03, 0xC0});
    CHECK(bench.ask({0x02, 0x98, 12}) == Message{0x02, 0});
    CHECK(bench.ask({0x03, 0x98}) == Message{0x03, 0, 12});
    CHECK(bench.ask({0x02, 0x9E, 1}) == Message{0x02, 0});
    CHECK(bench.ask({0x02, 0x77, 1}) == Message{0x02, 0xC0});
}

TEST_CASE("unknown commands are called so, and short ones fail") {
    Bench bench;
    bench.enter();
    CHECK(bench.ask({0x44}) == Message{0x44, 0xC9});
    for (uint8_t command : {0x02, 0x03, 0x06, 0x10, 0x11, 0x12, 0x13, 0x14, 0x15, 0x16, 0x17, 0x18,
                            0x19, 0x1A, 0x1B, 0x1C, 0x1D})
        CHECK(bench.ask({command}) == Message{command, 0xC0});
}

TEST_CASE("the chip is entered if it answers as the PC expects, and left") {
    Bench bench;
    CHECK(bench.enter() == Message{0x10, 0});
    CHECK(bench.programmer.programming());
    CHECK(bench.ask({0x11, 1, 1}) == Message{0x11, 0});
    CHECK_FALSE(bench.programmer.programming());
    // Not looked at where the byte is; looked at where another one is, and where none is.
    CHECK(bench.ask({0x10, 0, 0, 0, 0, 0, 0x53, 0, 0xAC, 0x53, 0, 0}) == Message{0x10, 0});
    CHECK(bench.ask({0x10, 0, 0, 0, 0, 0, 0x53, 2, 0xAC, 0x53, 0, 0}) == Message{0x10, 0x80});
    CHECK(bench.ask({0x10, 0, 0, 0, 0, 0, 0x53, 5, 0xAC, 0x53, 0, 0}) == Message{0x10, 0x80});
    CHECK_FALSE(bench.programmer.programming());
    bench.memory.high_fuse |= 1 << 5;  // SPIEN off: the chip is deaf
    CHECK(bench.enter() == Message{0x10, 0x80});
}

TEST_CASE("without a chip that is entered nothing of it is read or written") {
    Bench bench;
    CHECK(bench.ask({0x12, 55, 1, 0xAC, 0x80, 0, 0}) == Message{0x12, 0xC0});
    CHECK(bench.ask({0x14, 0, 2, 0x20}) == Message{0x14, 0xC0});
    CHECK(bench.ask({0x1B, 4, 0x30, 0, 0, 0}) == Message{0x1B, 0xC0});
    CHECK(bench.ask({0x1D, 4, 4, 0, 0x30, 0, 0, 0}) == Message{0x1D, 0, 0, 0, 0, 0, 0});
}

TEST_CASE("flash pages are written and read back, low byte first, addresses going on") {
    Bench bench;
    bench.enter();
    bench.address(0x3800);
    Message page(128);
    std::iota(page.begin(), page.end(), uint8_t{1});
    CHECK(bench.write(0x13, 0xC1, 0x40, 0x4C, page) == Message{0x13, 0});
    CHECK(bench.write(0x13, 0xC1, 0x40, 0x4C, page) == Message{0x13, 0});
    for (size_t at : {0x7000, 0x7080})
        CHECK(std::equal(page.begin(), page.end(), bench.memory.flash.begin() + at));
    bench.address(0x3801);
    CHECK(bench.ask({0x14, 0, 3, 0x20}) == Message{0x14, 0, 3, 4, 5, 0});
    // A page in two halves: it is written with the second.
    bench.address(0);
    CHECK(bench.write(0x13, 0x41, 0x40, 0x4C, {1, 2}) == Message{0x13, 0});
    CHECK(bench.memory.flash[0] == 0xFF);
    CHECK(bench.write(0x13, 0xC1, 0x40, 0x4C, {3, 4}) == Message{0x13, 0});
    CHECK(bench.memory.flash[0] == 1);
    CHECK(bench.memory.flash[3] == 4);
}

TEST_CASE("the eeprom is written in pages or byte by byte, and read back") {
    Bench bench;
    bench.enter();
    bench.address(0x10);
    CHECK(bench.write(0x15, 0xC1, 0xC1, 0xC2, {1, 2, 3, 4}) == Message{0x15, 0});
    CHECK(bench.write(0x15, 0x04, 0xC0, 0x00, {5, 6}) == Message{0x15, 0});
    bench.address(0x10);
    CHECK(bench.ask({0x16, 0, 7, 0xA0}) == Message{0x16, 0, 1, 2, 3, 4, 5, 6, 0xFF, 0});
}

TEST_CASE("counts that do not fit their message fail") {
    Bench bench;
    bench.enter();
    CHECK(bench.ask({0x13, 0, 4, 0xC1, 10, 0x40, 0x4C, 0, 0, 0, 1, 2}) == Message{0x13, 0xC0});
    CHECK(bench.ask({0x14, 0x01, 0x11, 0x20}) == Message{0x14, 0xC0});
    CHECK(bench.ask({0x14, 0x01, 0x10, 0x20}).size() == Stk500v2::BODY_MOST);
    CHECK(bench.ask({0x1D, 5, 4, 0, 0x30, 0, 0, 0}) == Message{0x1D, 0xC0});
    CHECK(bench.ask({0x1B, 0, 0x30, 0, 0, 0}) == Message{0x1B, 0xC0});
    CHECK(bench.ask({0x1B, 5, 0x30, 0, 0, 0}) == Message{0x1B, 0xC0});
}

TEST_CASE("fuses, lock bits and signature by their own commands, and any instruction by the "
          "universal one") {
    Bench bench;
    bench.enter();
    CHECK(bench.ask({0x1B, 4, 0x30, 0, 1, 0}) == Message{0x1B, 0, 0x95, 0});
    CHECK(bench.ask({0x17, 0xAC, 0xA8, 0, 0xD9}) == Message{0x17, 0, 0});
    CHECK(bench.ask({0x18, 4, 0x58, 0x08, 0, 0}) == Message{0x18, 0, 0xD9, 0});
    CHECK(bench.ask({0x19, 0xAC, 0xE0, 0, 0xFE}) == Message{0x19, 0, 0});
    CHECK(bench.ask({0x1A, 4, 0x58, 0, 0, 0}) == Message{0x1A, 0, 0xFE, 0});
    CHECK(bench.ask({0x1C, 4, 0x38, 0, 0, 0}) == Message{0x1C, 0, bench.memory.calibration, 0});
    CHECK(bench.ask({0x1D, 4, 4, 0, 0x30, 0, 0, 0}) == Message{0x1D, 0, 0, 0x30, 0, 0x1E, 0});
    CHECK(bench.ask({0x1D, 4, 1, 3, 0x30, 0, 2, 0}) == Message{0x1D, 0, 0x0F, 0});
    CHECK(bench.ask({0x1D, 4, 2, 7, 0x30, 0, 2, 0}) == Message{0x1D, 0, 0, 0, 0});
    CHECK(bench.ask({0x1D, 0, 0, 0}) == Message{0x1D, 0, 0});
}

}  // namespace test_stk500v2
