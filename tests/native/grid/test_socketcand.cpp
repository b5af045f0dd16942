#include <doctest/doctest.h>

#include <random>

#include "grid/socketcand.h"

using namespace kilotwin;

namespace test_socketcand {

namespace {

struct Heard {
    std::string replies;
    std::vector<CanFrame> frames;
    uint64_t malformed = 0;
    bool raw = false;
    bool operator==(const Heard &) const = default;
};

/// Replies of a session to `text` if it comes in pieces of at most `piece` bytes.
Heard tell(std::string_view text, size_t piece) {
    SocketcandSession session(4);
    Heard heard;
    for (size_t i = 0; i < text.size(); i += piece)
        session.feed(text.substr(i, piece), heard.replies, heard.frames);
    heard.malformed = session.malformed();
    heard.raw = session.raw();
    return heard;
}

}  // namespace

TEST_CASE("a session reads commands however they are cut") {
    std::string_view text = "< open can2 >< rawmode >\n< send 7FF 3 1 2 ff >noise< send 0 0 >"
                            "< send < send 1 1 AB > < echo ><nonsense>";
    Heard whole = tell(text, text.size());
    CHECK(whole.replies == "< ok >< ok >< error unknown command >< error unknown command >"
                           "< echo >< error unknown command >");
    REQUIRE(whole.frames.size() == 3);
    CHECK(whole.frames[0] == CanFrame{0x7FF, 3, false, {1, 2, 0xFF}});
    CHECK(whole.frames[1] == CanFrame{0, 0});
    CHECK(whole.frames[2] == CanFrame{1, 1, false, {0xAB}});
    CHECK(whole.malformed == 3);
    for (size_t piece = 1; piece < text.size(); piece++) CHECK(tell(text, piece) == whole);
}

TEST_CASE("a command without an end takes no more memory than a command may have") {
    SocketcandSession session(1);
    std::string replies;
    std::vector<CanFrame> frames;
    session.feed("<" + std::string(100'000, 'x') + ">< echo >", replies, frames);
    CHECK(replies == "< error unknown command >< echo >");
    CHECK(session.malformed() == 1);
}

TEST_CASE("after a bus that is not there nothing more is heard") {
    Heard heard = tell("< open can4 >< open can0 >< send 1 0 >", 1000);
    CHECK(heard.replies == "< error could not open bus >");
    CHECK(heard.frames.empty());
}

TEST_CASE("frames are written with microseconds and two digits a byte") {
    std::string text;
    append_socketcand_frame(text, {0x043, 3, false, {0x01, 0xAB, 0x00}}, 1763777777.000001);
    append_socketcand_frame(text, {0x7FF, 0}, 0.9999996);
    append_socketcand_frame(text, {0x7FF, 0}, -2.25);
    append_socketcand_frame(text, {0x7FF, 0}, -1e-9);
    CHECK(text == "< frame 043 1763777777.000001 01AB00 >< frame 7FF 1.000000  >"
                  "< frame 7FF -2.250000  >< frame 7FF 0.000000  >");
}

}  // namespace test_socketcand
