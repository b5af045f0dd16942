#include "robots/robot.h"

namespace kilotwin {

static_assert(sizeof(Robot) == 6 * sizeof(CacheLine));

Robot::Robot(RobotContext &context, Driver &driver, uint32_t index, const Calibration &calibration,
             Cycles power_up)
    : record_(context, driver, index, calibration, power_up) {
    driver.switch_on(record_);
}

void Robot::run(Cycles until) {
    record_.arbitrated = false;
    go_on(until);
}

Cycles Robot::run_arbitrated(Cycles until) {
    record_.arbitrated = true;
    go_on(until);
    record_.granted_from = NEVER;
    return record_.question == Question::NONE ? until : record_.now;
}

void Robot::go_on(Cycles until) {
    if (stopped() || until <= record_.now || record_.question != Question::NONE) return;
    record_.until = until;
    driver().run(record_);
}

// Boards

void Robot::report(Cycles at, uint32_t tick, EventKind kind, std::string text) {
    record_.now = at;
    record_.last_tick = tick;
    record_.report(kind, std::move(text));
}

void Robot::crash(Cycles at, uint32_t tick, std::string text, CodePath code) {
    record_.now = at;
    record_.last_tick = tick;
    record_.stop(EventKind::CRASH, std::move(text), std::move(code));
}

// Failures

void Robot::die(Cycles at, uint32_t tick) {
    record_.now = at;
    record_.last_tick = tick;
    record_.die();
}

void Robot::deafen(Cycles at, uint32_t tick) {
    report_fault(at, tick, "deaf");
    record_.deafen();
}

void Robot::receive_again(Cycles at, uint32_t tick) {
    report_fault(at, tick, "receives again");
    record_.is_deaf = false;
}

void Robot::transmit_again(Cycles at, uint32_t tick) {
    report_fault(at, tick, "transmits again");
    record_.is_mute = false;
}

void Robot::mute(Cycles at, uint32_t tick) {
    report_fault(at, tick, "mute");
    record_.is_mute = true;
}

// A guest may have been run less far, and goes on from there.
void Robot::report_fault(Cycles at, uint32_t tick, const char *what) {
    record_.context->events.push_back(
        {at, index(), tick, driver().name(), EventKind::FAULT, what, {}});
}

// Tentative runs

void Robot::save(Saved &saved) const {
    saved.record_ = record_;
    driver().keep(record_, *saved.own_);
}

void Robot::restore(const Saved &saved) {
    record_ = saved.record_;
    driver().restore(record_, *saved.own_);
}

bool Robot::run_tentatively(Cycles until, const Saved &saved) {
    if (!driver().can_undo(record_)) return false;
    Events &events = record_.context->events;
    const size_t reported = events.size();
    run_in_the_dark(until);
    if (events.size() == reported && driver().can_undo(record_)) return true;
    events.erase(events.begin() + static_cast<ptrdiff_t>(reported), events.end());
    restore(saved);
    return false;
}

void Robot::bring_back(const Saved &saved, Cycles until) {
    restore(saved);
    run_in_the_dark(until);
    record_.motor_commands.clear();
}

void Robot::run_in_the_dark(Cycles until) {
    record_.in_the_dark = true;
    run_arbitrated(until);
    record_.in_the_dark = false;
}

}  // namespace kilotwin
