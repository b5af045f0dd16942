// Frames in flight and carrier sense, by themselves: stations without programs and without places.
#include "infrared/frames_in_flight.h"

#include <doctest/doctest.h>

#include "infrared/carrier_sense.h"

using namespace kilotwin;

namespace test_frames_in_flight {

namespace {

constexpr double RANGE_M = 0.1;
constexpr message_t NO_MESSAGE = {};

/// Station 1 receives 0 and 2, which do not receive one another.
struct Line {
    FramesInFlight frames{3};

    Frame &begin(uint32_t sender, Cycles at) {
        Frame &frame = frames.put_on_air(sender, at, RANGE_M, NO_MESSAGE);
        frames.spoil(1);
        frames.reach(frame, {1, 50, frames.is_dark(1) ? Fate::CLEAR : Fate::COLLIDED});
        return frame;
    }
    Fate fate(uint32_t sender) { return frames.of(sender).reached.front().fate; }
};

}  // namespace

TEST_CASE("a frame alone stays clear, and leaves its receiver dark when it has ended") {
    Line line;
    const Frame &frame = line.begin(0, 100);
    CHECK(line.frames.is_on_air(0));
    CHECK_FALSE(line.frames.is_dark(1));
    CHECK(line.frames.is_dark(2));
    CHECK(line.fate(0) == Fate::CLEAR);
    line.frames.take_off_air(frame);
    CHECK_FALSE(line.frames.is_on_air(0));
    CHECK(line.frames.is_dark(1));
    CHECK(frame.begin == 100);  // still to be read
}

TEST_CASE("two frames collide at a receiver that both reach") {
    Line line;
    line.begin(0, 100);
    line.begin(2, 200);
    CHECK(line.fate(0) == Fate::COLLIDED);
    CHECK(line.fate(2) == Fate::COLLIDED);
}

TEST_CASE("a receiver that begins to send is deaf for what it was receiving") {
    Line line;
    line.begin(0, 100);
    line.frames.put_on_air(1, 150, RANGE_M, NO_MESSAGE);
    line.frames.deafen(1);
    CHECK(line.fate(0) == Fate::DEAF);
}

TEST_CASE("carrier sense sees a start pulse within its window, and no other") {
    using Sense = CarrierSense;
    auto finds_busy = [](Cycles attempt, Cycles other) {
        Line line;
        line.begin(0, other);
        const Frame &frame = line.frames.put_on_air(1, attempt, RANGE_M, NO_MESSAGE);
        return Sense(true, false, line.frames).finds_busy(frame);
    };
    constexpr Cycles AT = 1'000'000;
    CHECK_FALSE(finds_busy(AT, AT + Sense::WINDOW_BEGIN - 1));
    CHECK(finds_busy(AT, AT + Sense::WINDOW_BEGIN));
    CHECK(finds_busy(AT, AT + Sense::WINDOW_END - 1));
    CHECK_FALSE(finds_busy(AT, AT + Sense::WINDOW_END));
    // The stop pulse of the other's leader, nine slots after its start.
    CHECK(finds_busy(AT, AT + Sense::WINDOW_END - 1 - 9 * 269));
    CHECK_FALSE(finds_busy(AT, AT + Sense::WINDOW_END - 9 * 269));
}

TEST_CASE("carrier sense that is off finds the channel free, one held busy never does") {
    Line line;
    line.begin(0, 1000);
    const Frame &frame = line.frames.put_on_air(1, 0, RANGE_M, NO_MESSAGE);
    CHECK(CarrierSense(true, false, line.frames).finds_busy(frame));
    CHECK_FALSE(CarrierSense(false, false, line.frames).finds_busy(frame));
    FramesInFlight dark(1);
    const Frame &alone = dark.put_on_air(0, 0, RANGE_M, NO_MESSAGE);
    CHECK_FALSE(CarrierSense(true, false, dark).finds_busy(alone));
    CHECK(CarrierSense(false, true, dark).finds_busy(alone));
}

TEST_CASE("a frame is noticed at a receiver 9 us after its first pulse begins") {
    Line line;
    line.begin(0, 1000);
    const CarrierSense sense(true, false, line.frames);
    CHECK_FALSE(sense.is_receiving(1, 1071));
    CHECK(sense.is_receiving(1, 1072));
    CHECK_FALSE(sense.is_receiving(2, 2000));
}

TEST_CASE("the window of carrier sense begins two slots after the attempt and takes 235 polls") {
    // In cycles of the chip (hardware.md 1.6): slots of 269, polls of 8.
    CHECK(CarrierSense::WINDOW_BEGIN == 538);
    CHECK(CarrierSense::WINDOW_END == 2418);
}

TEST_CASE("a station may be busy while it is lit or sends, or if it is held busy, and else not") {
    Line line;
    const CarrierSense sense(true, false, line.frames);
    for (uint32_t station : {0, 1, 2}) CHECK_FALSE(sense.may_be_busy(station));
    line.begin(0, 1000);
    CHECK(sense.may_be_busy(0));
    CHECK(sense.may_be_busy(1));
    CHECK_FALSE(sense.may_be_busy(2));
    CHECK(CarrierSense(true, true, line.frames).may_be_busy(2));
}

}  // namespace test_frames_in_flight
