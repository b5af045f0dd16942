/// A robot on the bench: a board with a program linked against firmware/kilolib, light shone on
/// it frame by frame, and what it sends read back.
#ifndef KILOTWIN_TESTS_KILOLIB_BENCH_H
#define KILOTWIN_TESTS_KILOLIB_BENCH_H

#include <doctest/doctest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "avr/boards/robot_board.h"
#include "base/chance.h"
#include "kilolib/core/robot_commands.h"
#include "message.h"

namespace kilotwin {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
constexpr Cycles SLOT = 269;

/// Questions to programs/probe.c.
enum Request : uint8_t {
    RAND_SOFT = 1,
    RAND_SEED,
    RAND_HARD,
    CRC,
    DISTANCE,
    LIGHT,
    VOLTAGE_READING,
    TEMPERATURE,
    DELAY,
    COLOR,
    MOTORS,
    SPINUP,
};

/// A frame as it was on air: when its first and last pulse began, and whether its crc is right.
struct Frame {
    Cycles begin, end;
    message_t message;
    bool crc_is_right;
};

message_t make_message(uint8_t type, std::vector<uint8_t> data = {});

/// The frames in the light of an LED. Fails the test on light that belongs to none.
std::vector<Frame> frames_of(const std::vector<BoardOutputs::Light> &light);

class Bench {
  public:
    /// `program` is a path, or the name of one built for these tests.
    explicit Bench(const std::string &program, uint16_t uid = 7, Cycles power_up = 0);
    explicit Bench(std::shared_ptr<const FlashImage> image, uint16_t uid = 7, Cycles power_up = 0);

    void run_ms(double ms) { board.run(board.now() + static_cast<Cycles>(ms * double(MS))); }

    /// Shines a frame on it, beginning soon; the board is run until it is over, and a bit more.
    void hear(const message_t &message, distance_measurement_t strength = {300, 600});

    /// Shines the pulses of a frame that begins at `at`, without running the board. Slots are
    /// `slot` cycles long.
    void shine_frame(Cycles at, const message_t &message, distance_measurement_t strength,
                     Cycles slot = SLOT);

    /// Sends RUN and waits until loop() is called.
    void start();

    /// Lets the probe carry out `request`; returns its result.
    int16_t ask(Request request, uint16_t argument = 0);

    uint16_t address(const std::string &symbol) const;
    uint8_t byte(const std::string &symbol) const { return board.read(address(symbol)); }
    uint32_t word(const std::string &symbol, int bytes) const;
    void set(const std::string &symbol, uint32_t value, int bytes);
    robot_state_t state() const { return static_cast<robot_state_t>(byte("kilolib_robot")); }
    uint32_t ticks() const { return word("kilo_ticks", 4); }

    /// The message that the probe's callback got last.
    uint32_t low_gain() const { return word("last_distance", 2); }
    uint32_t high_gain() const { return word("last_distance", 4) >> 16; }

    std::shared_ptr<const FlashImage> flash;
    Chance chance{1};
    Calibration calibration;
    RobotBoard board;
};

}  // namespace kilotwin

#endif
