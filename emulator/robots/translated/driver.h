/// The driver of robots whose program is translated.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_DRIVER_H
#define KILOTWIN_ROBOTS_TRANSLATED_DRIVER_H

#include <vector>

#include "base/memory.h"
#include "robots/driver.h"
#include "robots/translated/program.h"
#include "robots/translated/state.h"

namespace kilotwin {

class TranslatedDriver final : public Driver {
  public:
    /// For up to `robots` of them. `program` must live on.
    TranslatedDriver(TranslatedProgram &program, size_t robots, uint32_t shares);

    void switch_on(RobotRecord &robot) override;
    void switch_off(RobotRecord &robot) override;
    void run(RobotRecord &robot) override;
    void count_on(RobotRecord &robot, uint32_t ticks) override;
    Cycles next_ask(const RobotRecord &robot) const override;
    void received_beside(RobotRecord &robot, Cycles at) override;
    void disturb(RobotRecord &robot, Cycles begin, const message_t &message) override;
    std::vector<uint8_t> variables(const RobotRecord &robot) const override;
    Standing standing(const RobotRecord &robot) const override;
    void begin_hold(RobotRecord &robot) override;

  private:
    static TranslatedState &of(const RobotRecord &robot) {
        return *static_cast<TranslatedState *>(robot.own);
    }
    /// As next_ask(), of a robot within no interrupt and without a message that is due.
    Cycles next_ask_at_rest(const RobotRecord &robot) const;
    Cycles next_request(const RobotRecord &robot) const;

    TranslatedProgram &program_;
    Swarm<CacheLine> memory_;  ///< of the TranslatedStates
    size_t used_ = 0;          ///< lines
};

}  // namespace kilotwin

#endif
