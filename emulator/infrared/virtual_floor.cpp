#include "infrared/virtual_floor.h"

#include <algorithm>

namespace kilotwin {

VirtualFloor::VirtualFloor(const Settings &settings, Cycles begin, Cycles world_step, size_t robots)
    : settings_(settings),
      begin_(begin),
      world_step_(world_step),
      longest_gap_((settings.step_ticks * TICK_CYCLES + world_step - 1) / world_step * world_step),
      told_(robots) {}

bool VirtualFloor::senses_at(Cycles at) const {
    if (at < begin_) return false;
    // A control step fell into the world step that ends at `at`.
    Cycles control_step = settings_.step_ticks * TICK_CYCLES;
    return at == begin_ ||
           (at - begin_) / control_step != (at - begin_ - world_step_) / control_step;
}

Cycles VirtualFloor::next_sensing(Cycles at) const {
    if (at < begin_) return begin_;
    const Cycles control_step = settings_.step_ticks * TICK_CYCLES;
    const Cycles next = ((at - begin_) / control_step + 1) * control_step;
    return begin_ + (next + world_step_ - 1) / world_step_ * world_step_;
}

void VirtualFloor::give(Robot &robot, Told &told, Cycles at, Cycles until) {
    message_t message = {};
    message.type = WIRE_TYPE_CELL;
    wire_put_cell(message.data, told.cell);
    for (at = std::max(at, told.due); at < until; at = told.due) {
        robot.receive_beside(at, message, Trail::Kind::FLOOR);
        const Cycles repeat = at + settings_.repeat_ticks * TICK_CYCLES - longest_gap_;
        told.due = next_sensing(begin_of_step(repeat, world_step_));
    }
}

}  // namespace kilotwin
