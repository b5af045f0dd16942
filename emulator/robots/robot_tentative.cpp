// Tentative runs of a robot, and how they are undone.
#include "robots/robot.h"

namespace kilotwin {

void Robot::save(Saved &saved) const {
    saved.record_ = *this;
    program_->copy_state_of(image_, saved.variables_.data());
}

void Robot::restore(const Saved &saved) {
    static_cast<RobotRecord &>(*this) = saved.record_;
    program_->set_state_of(image_, saved.variables_.data());
}

bool Robot::run_tentatively(Cycles until, const Saved &saved) {
    if (GuestStack::instance().keeps_float_control(&now_)) return false;
    Events &events = context_->events;
    const size_t told = events.size();
    run_in_the_dark(until);
    if (events.size() == told && !GuestStack::instance().keeps_float_control(&now_)) return true;
    events.erase(events.begin() + static_cast<ptrdiff_t>(told), events.end());
    GuestStack::instance().forget(&now_);
    restore(saved);
    return false;
}

void Robot::bring_back(const Saved &saved, Cycles until) {
    restore(saved);
    run_in_the_dark(until);
    motor_commands.clear();
}

void Robot::run_in_the_dark(Cycles until) {
    in_the_dark_ = true;
    run_arbitrated(until);
    in_the_dark_ = false;
}

}  // namespace kilotwin
