#include "robots/native/driver.h"

#include <new>
#include <utility>

#include "base/errors.h"

namespace kilotwin {

namespace {

struct KeptRobot : Driver::Kept {
    NativeRobot::Kept robot;
};

constexpr size_t ROBOT_LINES = cache_lines(sizeof(NativeRobot));

}  // namespace

NativeDriver::NativeDriver(std::vector<Program *> programs, size_t robots)
    : Driver(Tier::NATIVE, programs.front()->name(), programs.front()->path()),
      programs_(std::move(programs)) {
    const Program &program = *programs_.front();
    own_bytes_ = ROBOT_LINES * sizeof(CacheLine) + program.state_bytes();
    heeds_light_ = program.reads_sensors();
    // One that notes which of its code has run would note what is undone.
    can_restore_ = !program.is_covered();
    memory_.resize(robots * cache_lines(own_bytes_));
}

void NativeDriver::switch_on(RobotRecord &robot) {
    const size_t end = used_ + cache_lines(own_bytes_);
    if (end > memory_.size()) throw EngineError("a driver has more robots than it was made for");
    CacheLine *own = &memory_[used_];
    used_ = end;
    Program &program = *programs_[robot.context->share];
    robot.own = new (own) NativeRobot(program, robot, own[ROBOT_LINES].bytes);
}

void NativeDriver::switch_off(RobotRecord &robot) { of(robot).~NativeRobot(); }

std::unique_ptr<Driver::Kept> NativeDriver::make_kept() const {
    return std::make_unique<KeptRobot>();
}

void NativeDriver::keep(const RobotRecord &robot, Kept &kept) const {
    of(robot).keep(static_cast<KeptRobot &>(kept).robot);
}

void NativeDriver::restore(RobotRecord &robot, const Kept &kept) const {
    of(robot).restore(static_cast<const KeptRobot &>(kept).robot);
}

bool NativeDriver::can_undo(const RobotRecord &robot) const { return of(robot).can_undo(); }

}  // namespace kilotwin
