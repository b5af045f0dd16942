/// The driver of native robots, of one program.
#ifndef KILOTWIN_ROBOTS_NATIVE_DRIVER_H
#define KILOTWIN_ROBOTS_NATIVE_DRIVER_H

#include <vector>

#include "base/memory.h"
#include "robots/driver.h"
#include "robots/native/robot.h"

namespace kilotwin {

class NativeDriver final : public Driver {
  public:
    /// For up to `robots` of them. `programs`: the same one, as it is loaded for each share of the
    /// robots; they must live on.
    NativeDriver(std::vector<Program *> programs, size_t robots);

    void switch_on(RobotRecord &robot) override;
    void switch_off(RobotRecord &robot) override;
    void run(RobotRecord &robot) override { of(robot).run(); }
    void count_on(RobotRecord &robot, uint32_t ticks) override { of(robot).count_on(ticks); }
    Cycles next_ask(const RobotRecord &robot) const override { return of(robot).next_ask(); }
    uint8_t color(const RobotRecord &robot, Cycles at) const override {
        return of(robot).color(at);
    }
    std::vector<uint8_t> variables(const RobotRecord &robot) const override {
        return of(robot).variables();
    }
    std::unique_ptr<Kept> make_kept() const override;
    void keep(const RobotRecord &robot, Kept &kept) const override;
    void restore(RobotRecord &robot, const Kept &kept) const override;
    bool can_undo(const RobotRecord &robot) const override;

  private:
    static NativeRobot &of(const RobotRecord &robot) {
        return *static_cast<NativeRobot *>(robot.own);
    }

    std::vector<Program *> programs_;  ///< by share
    /// Each robot's NativeRobot, then its variables, which begin a cache line.
    Swarm<CacheLine> memory_;
    size_t used_ = 0;  ///< lines
};

}  // namespace kilotwin

#endif
