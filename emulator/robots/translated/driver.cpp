#include "robots/translated/driver.h"

#include <algorithm>
#include <cstring>
#include <new>

#include "base/board_clock.h"
#include "base/errors.h"
#include "base/prefetch.h"
#include "robots/translated/robot.h"

namespace kilotwin {

namespace {

constexpr size_t STATE_LINES = cache_lines(sizeof(TranslatedState));

// Room for so many frames at once: a swarm has many robots that are shone on by few.
constexpr size_t MORE_LIGHTS = 3;

/// Prefetches bytes that nearly every run touches: registers, the first variables, the top of the
/// stack and all beside the data space.
void prefetch_chip(const TranslatedImage &image) {
    constexpr size_t WORKING = 0x60, VARIABLES = 0x100, SOME = 0x100;
    constexpr size_t TOP = atmega328p::SRAM_END - 0x40;
    const auto *bytes = reinterpret_cast<const uint8_t *>(&image);
    prefetch_bytes(bytes, WORKING);
    prefetch_bytes(bytes + VARIABLES, SOME);
    prefetch_bytes(bytes + TOP, sizeof image - TOP);
}

/// Ticks up to `until` go by without its being executed: it is to be asked at the next one.
void pass_ticks(RobotRecord &robot) {
    if (robot.next_tick >= robot.until) return;
    const Cycles ticks = (robot.until - 1 - robot.next_tick) / robot.tick_length + 1;
    auto &clock = robot.core.transmit;
    transmit_clock_match(&clock);
    clock.counts = static_cast<uint16_t>(clock.counts + (ticks - 1) * TICK_MATCH);
    robot.last_tick += static_cast<uint32_t>(ticks);
    robot.next_tick += ticks * robot.tick_length;
}

}  // namespace

TranslatedDriver::TranslatedDriver(TranslatedProgram &program, size_t robots, uint32_t shares)
    : Driver(Tier::TRANSLATED, program.name(), program.path()),
      program_(program),
      memory_(robots * STATE_LINES) {
    program.make_room(shares);
    own_bytes_ = sizeof(TranslatedState);
    heeds_light_ = true;
}

void TranslatedDriver::switch_on(RobotRecord &robot) {
    if (used_ == memory_.size()) throw EngineError("a driver has more robots than it was made for");
    robot.own = new (&memory_[used_]) TranslatedState{switched_on(), {}};
    used_ += STATE_LINES;
}

void TranslatedDriver::switch_off(RobotRecord &robot) { of(robot).~TranslatedState(); }

/// A robot whose loop changes nothing need not be executed before something reaches it.
void TranslatedDriver::run(RobotRecord &robot) {
    if (robot.life == RobotRecord::Life::OFF) robot.life = RobotRecord::Life::ALIVE;
    const bool rests_on =
        robot.until <= robot.only_ticks_until && robot.next_message >= robot.until;
    if (rests_on && (robot.has_no_message || next_ask_at_rest(robot) >= robot.until)) {
        if (robot.has_no_message) pass_ticks(robot);
        robot.now = robot.until;
        return;
    }
    TranslatedState &state = of(robot);
    const TranslatedImage &image = state.image;
    prefetch_chip(image);
    const bool rests =
        image.pass_cycles != 0 && image.interrupt == TranslatedImage::Interrupt::NONE;
    const Debugging *debugging = robot.context->debugging;
    const bool is_held = debugging != nullptr && debugging->holds(robot.index);
    if (rests && !is_held && image.waits_for == 0 && robot.next_interrupt() >= robot.until) {
        robot.now = robot.until;
        return;
    }
    if (robot.context->black_box != nullptr)
        robot.context->black_box->runs(robot.index, robot.last_tick);
    TranslatedRobot(program_, robot, state).run();
    robot.forget_taken();
}

void TranslatedDriver::count_on(RobotRecord &robot, uint32_t ticks) {
    auto *data = reinterpret_cast<uint8_t *>(&of(robot).image) + program_.code().seam->ticks;
    robot.last_tick += ticks;
    std::memcpy(data, &robot.last_tick, sizeof robot.last_tick);
}

// The robot takes a message where a block of its code has ended: it may be an order to run. An
// interrupt that is not over may yet put the next request forward: one that has found the channel
// busy draws when it tries again.
Cycles TranslatedDriver::next_ask(const RobotRecord &robot) const {
    if (robot.life != RobotRecord::Life::ALIVE || robot.next_tick == NEVER) return NEVER;
    if (robot.may_ask_now || robot.next_message <= robot.now) [[unlikely]]
        return robot.holds_interrupts ? robot.next_tick + robot.waits_past_tick : robot.now;
    return next_ask_at_rest(robot);
}

Cycles TranslatedDriver::next_ask_at_rest(const RobotRecord &robot) const {
    if (robot.life != RobotRecord::Life::ALIVE || robot.next_tick == NEVER) return NEVER;
    return std::max(std::min(next_request(robot), robot.next_answer()),
                    robot.next_tick + robot.waits_past_tick);
}

// A program that names kilo_tx_period may shorten it any time.
Cycles TranslatedDriver::next_request(const RobotRecord &robot) const {
    if (robot.core.state != ROBOT_RUNNING && robot.core.state != ROBOT_SETUP) return NEVER;
    if (program_.code().seam->names_period != 0) return robot.next_tick;
    return robot.next_request(TX_PERIOD_DEFAULT);
}

void TranslatedDriver::received_beside(RobotRecord &robot, Cycles at) {
    if (robot.context->frame > 0) of(robot).written().beside.push_back(at);
}

void TranslatedDriver::disturb(RobotRecord &robot, Cycles begin, const message_t &message) {
    auto &lights = of(robot).written().lights;
    if (lights.size() == lights.capacity()) lights.reserve(lights.size() + MORE_LIGHTS);
    const uint64_t from = BoardClock{robot.power_up, robot.tick_length}.own_cycle(begin);
    lights.push_back({from, of(robot).image.sends_until, message, 0});
}

Driver::Standing TranslatedDriver::standing(const RobotRecord &robot) const {
    const TranslatedImage &image = of(robot).image;
    return {image.data.data(), image.flags.data(), image.pc, image.cycle};
}

/// Passes that it rests in are executed anew: a debugger may want something in them.
void TranslatedDriver::begin_hold(RobotRecord &robot) {
    if (program_.debugged() == nullptr)
        throw EngineError(name() + ": no code of it is there that a debugger can hold");
    TranslatedImage &image = of(robot).image;
    image.pass_cycles = 0;
    image.rest.ends = 0;
    image.changed |= CHANGED;
    robot.only_ticks_until = 0;
}

std::vector<uint8_t> TranslatedDriver::variables(const RobotRecord &robot) const {
    const auto *bytes = reinterpret_cast<const uint8_t *>(&of(robot).image);
    return {bytes, bytes + sizeof(TranslatedImage)};
}

}  // namespace kilotwin
