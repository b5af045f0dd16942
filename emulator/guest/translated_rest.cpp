// Ticks that are left out, since passes of the main loop change nothing in them (known_pass.h).
#include <algorithm>
#include <cstddef>
#include <cstring>

#include "guest/pass_tracer.h"
#include "guest/translated_robot.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr int MOST_PAUSE = 255;

}  // namespace

/// A pass of the main loop begins: whether it is one that is known, and how long that goes on.
/// Where passes change something in each tick, it looks ever more seldom.
bool Robot::Translated::recall() {
    if (at(seam_.robot) != ROBOT_RUNNING) return false;
    auto &known = robot_.program_->known_passes;
    known.looks++;
    const uint16_t stack = word(SPL);
    const auto now = static_cast<uint8_t>(flags[6] << 6 | flags[7] << 7);
    const uint32_t ticks = ticks_now();
    const KnownPass *found = nullptr;
    uint32_t lasts = 0;
    for (const KnownPass &one : known.passes) {
        if (one.pc != pc || one.stack != stack || one.status != now) continue;
        lasts = one.lasts(data, ticks);
        if (lasts == 0) continue;
        found = &one;
        break;
    }
    if (found == nullptr && lets_interrupts() && known.may_trace()) {
        known.traces++;
        if (auto traced = PassTracer(code_, *this).trace()) {
            found = &known.passes[known.keep(std::move(*traced))];
            lasts = found->lasts(data, ticks);
        }
    }
    // One that ends with this tick leaves nothing out, and looking for it costs as much.
    const int pause = lasts > 1 ? 0 : 2 * image_.recall_pause + 1;
    image_.recall_pause = static_cast<uint16_t>(std::min(pause, MOST_PAUSE));
    recalls_in = image_.recall_pause;
    if (lasts == 0) return false;
    image_.pass_cycles = found->cycles;
    image_.reads_from = static_cast<uint16_t>(found->reads_from);
    image_.reads_to = static_cast<uint16_t>(found->reads_to);
    image_.rest_ends = ticks + lasts;
    return true;
}

/// How many of the next ticks only count, come before `others`, and leave the known pass as it is.
uint64_t Robot::Translated::ticks_at_rest(uint64_t others) const {
    if (!can_count_tick()) return 0;
    const uint64_t after = 2 * image_.pass_cycles + robot_.program_->tick_cycles;
    if (image_.match + after > others || image_.match < cycle()) return 0;
    const uint64_t in_time = (others - after - image_.match) / TICK_CYCLES + 1;
    const auto clock = static_cast<uint16_t>(seam_.robot + offsetof(robot_core_t, transmit));
    const uint32_t counts = word(clock) + uint32_t{data[clock + 2]}, period = word(seam_.tx_period);
    static_assert(offsetof(transmit_clock_t, increment) == 2, "as avr-gcc packs it");
    if (counts > period) return 0;
    const uint64_t not_due = (period - counts) / TICK_MATCH + 1;
    return std::min({in_time, not_due, uint64_t{image_.rest_ends - ticks_now() - 1}});
}

/// Passes are known to go on, also over ticks: those that only count are left out. Each puts off
/// the passes behind it by its cycles. It comes into the midst of a pass, and must not come between
/// two reads of kilo_ticks. True if there was one.
bool Robot::Translated::take_ticks_at_rest() {
    if (image_.rest_ends == 0) return false;
    const uint64_t others = std::min({message_at_, serial_asks_at(), edge_at_, end_of_run()});
    const uint64_t most = ticks_at_rest(others);
    if (most == 0) return false;
    const uint64_t period = image_.pass_cycles, tick = robot_.program_->tick_cycles;
    const uint64_t step = (TICK_CYCLES - tick) % period;
    uint64_t phase = (image_.match - cycle()) % period, last_phase = 0, taken = 0;
    for (; taken < most && (phase <= image_.reads_from || phase > image_.reads_to); taken++) {
        last_phase = phase;
        phase += step;
        if (phase >= period) phase -= period;
    }
    if (taken == 0) return false;
    count(static_cast<uint32_t>(taken));
    image_.match += taken * TICK_CYCLES;
    const uint64_t now = image_.match - TICK_CYCLES - last_phase + period + tick;
    limit_ = std::max(now, limit_);
    set_cycle(now);
    return true;
}

/// World time up to which nothing that the robot does can differ from rest, unless it is asked.
Cycles Robot::Translated::rests_until() const {
    if (image_.rest_ends == 0 || image_.pass_cycles == 0 || !can_count_tick() ||
        serial_asks_at() != TranslatedImage::NO_TIME)
        return 0;
    const uint32_t ticks = image_.rest_ends - ticks_now();
    return clock_.world_time(image_.match + uint64_t{ticks - 1} * TICK_CYCLES);
}

}  // namespace kilotwin
