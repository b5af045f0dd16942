#include "modules/guest_modules.h"

#include <algorithm>
#include <utility>

namespace kilotwin {

GuestModules::GuestModules(const std::string &program, const std::string &name, uint32_t count,
                           const Chance &chance, bool gains_are_mm)
    : program_(Program::load(program, name)),
      context_{chance, events_, gains_are_mm},
      lines_(cache_lines(program_.state_bytes())),
      images_(new CacheLine[lines_ * count]) {
    const auto *table = program_.table().module;
    acts_alone_ = table != nullptr && table->acts_alone != nullptr;
    modules_.reserve(count);
}

void GuestModules::add(uint8_t x, uint8_t y, Cycles tick, Cycles power_up) {
    const auto index = static_cast<uint32_t>(modules_.size());
    modules_.emplace_back(context_, program_, index, x, y, tick, power_up,
                          images_[index * lines_].bytes);
}

void GuestModules::set_power(uint32_t index, Cycles at, bool on) {
    if (on) modules_[index].reset(at);
}

std::vector<uint16_t> GuestModules::filters(uint32_t index) const {
    const auto filters = modules_[index].filters();
    return {filters.begin(), filters.end()};
}

void GuestModules::receive_can(uint32_t index, Cycles at, const CanFrame &frame,
                               const CanErrors &errors) {
    auto counter = [](uint32_t count) {
        return static_cast<uint8_t>(std::min<uint32_t>(count, UINT8_MAX));
    };
    modules_[index].set_can_errors(counter(errors.transmit), counter(errors.receive));
    modules_[index].receive_can(at, frame);
}

CellLight GuestModules::light(uint32_t index, uint8_t cell, Cycles at) {
    return modules_[index].light(cell, at);
}

ModuleDriver::About GuestModules::about(uint32_t index) {
    const Module &module = modules_[index];
    const auto &lost = module.counts();
    return {module.state_name(), module.stopped(), module.ticks(), lost.frames_refused,
            lost.frames_missed};
}

Events GuestModules::take_events() { return std::exchange(events_, {}); }

Cycles GuestModules::next_event(uint32_t index) const {
    const Module &module = modules_[index];
    return module.asks() ? NEVER : std::max(module.next_event(), module.now());
}

ModuleDriver::Ran GuestModules::run(uint32_t index, Cycles until, bool heard, ModuleNodes &nodes) {
    Module &module = modules_[index];
    Ran ran;
    if (heard)
        module.run(until);
    else
        ran.unheard = module.run_unheard(until);
    for (const CanOutput &output : module.can_frames) nodes.queue(index, output);
    module.can_frames.clear();
    if (!module.asks()) return ran;
    if (heard) {
        ran.asks = module.outgoing();
        return ran;
    }
    module.answer(Module::Answer::SENT);
    ran.unheard++;
    return ran;
}

bool GuestModules::answer(uint32_t index, Cycles asked, Module::Answer answer) {
    Module &module = modules_[index];
    if (!module.asks() || module.outgoing().at != asked) return false;
    module.answer(answer);
    return true;
}

void GuestModules::catch_up(uint32_t index, Cycles at) {
    if (!modules_[index].asks()) modules_[index].run(at);
}

void GuestModules::receive_ir(uint32_t index, Cycles at, uint8_t cell, const message_t &message,
                              distance_measurement_t distance, bool crc_error) {
    modules_[index].receive_ir(at, cell, message, distance, crc_error);
}

}  // namespace kilotwin
