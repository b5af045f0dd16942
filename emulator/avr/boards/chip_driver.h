/// The driver of robots whose program runs on a board. The channel executes boards in lock-step
/// (board_stations.h): here is what a robot's record needs of its own.
#ifndef KILOTWIN_AVR_BOARDS_CHIP_DRIVER_H
#define KILOTWIN_AVR_BOARDS_CHIP_DRIVER_H

#include <string>
#include <vector>

#include "robots/driver.h"

namespace kilotwin {

class ChipDriver final : public Driver {
  public:
    /// `tier` is one of those on boards; `path` names the image, a .hex or its translation.
    ChipDriver(Tier tier, const std::string &name, const std::string &path)
        : Driver(tier, name, path) {}

    void switch_on(RobotRecord & /*robot*/) override {}
    void switch_off(RobotRecord & /*robot*/) override {}
    void run(RobotRecord & /*robot*/) override {}
    Cycles next_ask(const RobotRecord & /*robot*/) const override { return NEVER; }
    std::vector<uint8_t> variables(const RobotRecord & /*robot*/) const override { return {}; }
};

}  // namespace kilotwin

#endif
