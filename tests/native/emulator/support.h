/// Shared by the engine's tests: scenes to put robots into, and a bench for robots without a
/// world.
#ifndef KILOTWIN_TESTS_SUPPORT_H
#define KILOTWIN_TESTS_SUPPORT_H

#include <doctest/doctest.h>

#include <deque>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "../settings.h"
#include "kilolib.h"  // RGB
#include "robots/native/driver.h"
#include "simulation/simulation.h"

namespace kilotwin::testing {

/// Messages that the program `puppet` obeys, beside those of kilolib.
enum PuppetMessage : uint8_t {
    MOTORS = 0x20,  ///< left, right
    COLOR = 0x21,   ///< RGB()
    SEND = 0x22,    ///< type of what it sends from now on, 0 nothing; then 1 for a wrong CRC
    SAY = 0x23,     ///< 1: prints whatever else it hears
};

constexpr uint8_t FULL = 70;  ///< motor value that drives a foot-bot straight at full speed

/// Whether KILOTWIN_TEST_LONG is set, as long tests do: cases that take long then try all that they
/// can, and a part of it otherwise.
bool thorough();

std::string guest(const std::string &name);

/// A message with the right CRC.
message_t message(uint8_t type, std::initializer_list<uint8_t> data = {});
message_t run_message();

constexpr Cycles ticks(uint64_t count) { return count * TICK_CYCLES; }

Arena square_hall(double side_m);
Arena round_hall(double diameter_m);

/// Numbers from a test's own generator, so that "random" scenes are the same everywhere.
class Dice {
  public:
    explicit Dice(uint64_t seed) : chance_(seed) {}
    double between(double low, double high) {
        return low + (high - low) * chance_.uniform(0, Purpose::PLACE, n_++);
    }
    uint32_t below(uint32_t limit) {
        return static_cast<uint32_t>(chance_.uniform(0, Purpose::PLACE, n_++) * limit);
    }

  private:
    Chance chance_;
    uint64_t n_ = 0;
};

/// A run in the making: foot-bots without a floor, RUN at 0.
struct Scene {
    explicit Scene(const Arena &arena, uint64_t seed = 1);

    /// Returns the index of the first of them.
    uint32_t add(const std::string &program, const std::vector<Pose> &poses);
    uint32_t add_anywhere(const std::string &program, size_t count);

    /// A message to one robot, or to all.
    void tell(int64_t tick, uint32_t robot, const message_t &what);
    void tell_all(int64_t tick, const message_t &what);

    /// From `tick` on a puppet drives as its motors are set here.
    void motors(int64_t tick, uint32_t robot, uint8_t left, uint8_t right) {
        tell(tick, robot, message(MOTORS, {left, right}));
    }

    SimulationDef def;
    uint32_t robots = 0;
};

/// 28 that wander, send or talk on the Kilobot medium: close together or far apart, in steps of one
/// tick or four, by the seeds 31 to 34.
Scene crowd_on_kilobot_medium(uint64_t seed);

/// The poses of a sample as they were stored.
Pose pose_of(const Samples &samples, uint32_t robot, size_t row = 0);

/// Some robots on a bench: they run, hear what they are told, but stand in no world.
class Bench {
  public:
    explicit Bench(const std::vector<std::string> &programs, uint64_t seed = 1);

    void tell(Cycles at, uint32_t robot, const message_t &what, int16_t distance_mm = 0);
    void run(Cycles until, Cycles slice = ticks(64));

    /// Prints of a robot, with times; other events are in `events`.
    std::vector<Event> prints(uint32_t robot) const;
    std::vector<std::string> said(uint32_t robot) const;
    std::vector<Event> others(uint32_t robot) const;
    std::vector<Emission> sent(uint32_t robot) const;
    Robot &robot(uint32_t index) { return robots_[index]; }

    Events events;
    std::vector<Emission> emissions;

  private:
    Chance chance_;
    RobotContext context_;
    std::vector<std::unique_ptr<Driver>> drivers_;
    std::deque<Robot> robots_;
    Cycles now_ = 0;
};

/// The LED's colour at the time a robot has been run up to.
inline uint8_t shown(const Robot &robot) { return robot.color(robot.now()); }

std::vector<std::string> texts(const Events &events, uint32_t robot,
                               EventKind kind = EventKind::PRINT);

/// An event's text up to the address in it, which differs with the place that a program is loaded
/// to.
std::string text_without_address(const Event &event);

/// A sample of two robots, no value of which is like another.
inline Samples two_robots() {
    Samples samples;
    samples.tick.push_back(0);
    samples.add_robot({{1, 2}, 3}, 0x3F, 0);
    samples.add_robot({{-0.5, 0.25}, -1}, 0, 2);
    return samples;
}

}  // namespace kilotwin::testing

/// Text that a failed comparison of lists shows.
template <typename T> struct doctest::StringMaker<std::vector<T>> {
    static String convert(const std::vector<T> &list) {
        String out = "{";
        for (const auto &item : list) out += (out.size() > 1 ? ", " : "") + toString(item);
        return out + "}";
    }
};

#endif
