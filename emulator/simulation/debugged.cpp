// Robots that a debugger holds (robots/translated/debugging.h).
#include <string>
#include <utility>

#include "base/board_clock.h"
#include "base/errors.h"
#include "simulation/simulation.h"

namespace kilotwin {

void Simulation::hold(const std::vector<uint32_t> &robots,
                      std::function<void(const Debugging::Stop &)> on_stop) {
    for (const uint32_t robot : robots) robots_[slot_of(robot)].begin_hold();
    debugging_ = std::make_unique<Debugging>(size(), std::move(on_stop));
    for (const uint32_t robot : robots) debugging_->hold(robot);
    for (Share &share : shares_) share.context.debugging = debugging_.get();
}

void Simulation::note_written(uint32_t robot) {
    Robot &noted = robots_[slot_of(robot)];
    noted.begin_hold();
    written_ = std::make_unique<WrittenBytes>(robot, noted.standing().data);
    for (Share &share : shares_) share.context.written = written_.get();
}

WrittenBytes::Bytes Simulation::take_written() {
    if (!written_) throw EngineError("no bytes that a robot writes are noted");
    return written_->take(standing(written_->robot()).data);
}

Debugging &Simulation::debugging() const {
    if (!debugging_) throw EngineError("no robot is held by a debugger");
    return *debugging_;
}

std::optional<Debugging::Found> Simulation::found() const {
    Debugging &all = debugging();
    if (all.standing()) return all.last();
    for (const Robot &robot : robots_) {
        if (!all.holds(robot.index())) continue;
        const Driver::Standing now = robot.standing();
        all.look_behind({{robot.index(), now.cycle}, now.pc, now.data, robot.color(now_), false});
    }
    return all.last();
}

Driver::Standing Simulation::standing(uint32_t robot) const {
    Driver::Standing now = robots_[slot_of(robot)].standing();
    if (!debugging_ || !debugging_->standing()) return now;
    const Debugging::Stop &stop = *debugging_->standing();
    if (stop.place.robot != robot) return now;
    now.pc = stop.pc;
    now.cycle = stop.place.cycle;
    return now;
}

Cycles Simulation::moment_of(uint32_t robot, uint64_t cycle) const {
    return robots_[slot_of(robot)].clock().world_time(cycle);
}

uint64_t Simulation::own_cycle(uint32_t robot, double at_s) const {
    const Cycles at = run_at_ + static_cast<Cycles>(at_s * double{CYCLES_PER_SECOND});
    return robots_[slot_of(robot)].clock().own_cycle(at);
}

}  // namespace kilotwin
