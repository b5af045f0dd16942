/// The driver of modules as guests.
#ifndef KILOTWIN_MODULES_GUEST_MODULES_H
#define KILOTWIN_MODULES_GUEST_MODULES_H

#include <memory>
#include <string>
#include <vector>

#include "base/memory.h"
#include "modules/driver.h"

namespace kilotwin {

class GuestModules final : public ModuleDriver {
  public:
    /// The program of a file, named `name`, on `count` modules, which are added by add().
    /// EngineError if it is no module's. `chance` must live on.
    GuestModules(const std::string &program, const std::string &name, uint32_t count,
                 const Chance &chance, bool gains_are_mm);

    /// For what a receiver does while light comes (grid/cell_stations.h).
    Module &module(uint32_t index) { return modules_[index]; }
    const Module &module(uint32_t index) const { return modules_[index]; }

    void add(uint8_t x, uint8_t y, Cycles tick, Cycles power_up) override;
    void set_power(uint32_t index, Cycles at, bool on) override;
    std::vector<uint16_t> filters(uint32_t index) const override;
    void receive_can(uint32_t index, Cycles at, const CanFrame &frame,
                     const CanErrors &errors) override;
    CellLight light(uint32_t index, uint8_t cell, Cycles at) override;
    About about(uint32_t index) override;
    Events take_events() override;
    Cycles next_event(uint32_t index) const override;
    Ran run(uint32_t index, Cycles until, bool heard, ModuleNodes &nodes) override;
    bool answer(uint32_t index, Cycles asked, Module::Answer answer) override;
    void catch_up(uint32_t index, Cycles at) override;
    void receive_ir(uint32_t index, Cycles at, uint8_t cell, const message_t &message,
                    distance_measurement_t distance, bool crc_error) override;

  private:
    Program &program_;
    Events events_;
    ModuleContext context_;
    size_t lines_;  ///< of a module's state
    std::unique_ptr<CacheLine[]> images_;
    std::vector<Module> modules_;
};

}  // namespace kilotwin

#endif
