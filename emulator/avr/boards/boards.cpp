#include "avr/boards/boards.h"

#include <algorithm>
#include <utility>

#include "base/errors.h"
#include "base/message_crc.h"
#include "base/serial_line.h"
#include "infrared/robot_receiver.h"

namespace kilotwin {

namespace {

// From one of an overhead controller's frames to the next (hardware.md 1.11).
constexpr Cycles FRAME_PERIOD = 83'200;
// A message is shown so often in vain until it is given up.
constexpr unsigned MOST_SPOILT = 20;

}  // namespace

Boards::Boards(Swarm<Robot> &robots, const RobotContext &context)
    : robots_(robots),
      context_(context) {}

void Boards::add(uint32_t index, const FlashImage &flash, Cycles power_up) {
    if (place_of_.size() <= index) place_of_.resize(index + 1, -1);
    place_of_[index] = static_cast<int32_t>(places_.size());
    robots_with_.push_back(index);
    robots_rest_.push_back(0);
    places_.emplace_back(robots_[index], flash, power_up, context_.chance);
}

RobotBoard &Boards::board_of(size_t robot) {
    if (robot >= robots_.size()) throw EngineError("there is no robot " + std::to_string(robot));
    const auto index = static_cast<uint32_t>(robot);
    if (!has(index))
        throw EngineError("robot " + std::to_string(robot) +
                          " does not run on a board: only robots with a hex, or cpu = \"avr\", do");
    return board(index);
}

/// As far as whole quanta go before a board or a flash wants its turn, so that the lock-step stays
/// the same.
bool Boards::rest(Cycles until) {
    if (!told_.empty()) return false;
    for (const auto *rests : {&robots_rest_, &modules_rest_})
        for (Cycles rest : *rests) until = std::min(until, rest);
    if (!flashes_.empty()) until = std::min(until, flashes_.front().at);
    if (until < now_ + QUANTUM) return false;
    now_ += (until - now_) / QUANTUM * QUANTUM;
    return true;
}

/// Its IR LED goes off, and its chip does nothing more.
void Boards::switch_off(uint32_t robot) {
    Place &dead = place(robot);
    if (dead.lamp.on_since != NEVER) switch_lamp(dead.lamp, now_, false);
    dead.failed = true;
    dead.messages.clear();
    dead.shows = false;
    dead.board.switch_off();
    robots_rest_[static_cast<size_t>(place_of_[robot])] = NEVER;
}

/// A chip that was left alone lags behind; passing over its wait up to now costs a division. What
/// comes from outside may end the wait, so that it is executed in the next quantum.
RobotBoard &Boards::up_to_date(Place &place) {
    Cycles &rest = robots_rest_[static_cast<size_t>(place_of_[place.index])];
    if (rest > now_) place.board.run(now_);
    rest = 0;
    return place.board;
}

ModuleBoard &Boards::up_to_date(ModulePlace &module) {
    Cycles &rest = modules_rest_[module.index];
    if (rest > now_) module.board->run(now_);
    rest = 0;
    return *module.board;
}

/// While an LED is on, or in the midst of a frame, each quantum has something to pass on.
template <typename Board> Cycles Boards::rest_of(const Board &board, const Lamp &lamp) {
    return lamp.on_since != NEVER || lamp.reader.reading() ? 0 : board.rests_until();
}

void Boards::execute(Cycles until) {
    const size_t flashes = flashes_.size();
    for (size_t i = 0; i < places_.size(); i++) {
        if (robots_rest_[i] >= until) continue;
        Place &place = places_[i];
        if (context_.black_box != nullptr)
            context_.black_box->runs(place.index, place.board.tick());
        place.robot.read_sensors(now_, place.board.readings);
        place.board.run(until);
        take_outputs(place, until);
        robots_rest_[i] = rest_of(place.board, place.lamp);
    }
    for (ModulePlace &module : modules_)
        if (module.powered && modules_rest_[module.index] < until) execute(module, until);
    now_ = until;
    if (flashes_.size() == flashes) return;
    std::stable_sort(flashes_.begin(), flashes_.end(),
                     [](const Flash &a, const Flash &b) { return a.at < b.at; });
}

/// Messages to robots from outside the channel are to go to their boards as light.
void Boards::take_messages() {
    for (Place &place : places_)
        for (const Reception &reception : place.robot.take_inbox()) {
            if (place.messages.empty()) told_.push_back(&place);
            place.messages.push_back(reception);
        }
}

void Boards::shine_message(Place &place, Cycles begin) {
    message_t message = place.messages.front().message;
    message.crc = crc_of(message);
    for (Cycles offset : pulses_of(message))
        up_to_date(place).shine(
            {begin + offset, begin + offset + RobotBoard::SEEN_PULSE, RobotReceiver::FROM_ABOVE});
    place.light_free = std::max(place.light_free, begin + FRAME_PERIOD);
    place.shown_until = begin + FRAME_CYCLES;
    place.shows = true;
    place.spoils = false;
}

/// When a message has been shown: it is over, or has to be shown again.
void Boards::end_message(Place &place) {
    if (!place.shows || now_ < place.shown_until) return;
    place.shows = false;
    if (place.spoils && ++place.spoilt < MOST_SPOILT) return;
    place.messages.pop_front();
    place.spoilt = 0;
}

void Boards::take_outputs(Place &place, Cycles until) {
    auto &outputs = place.board.outputs;
    for (const auto &motor : outputs.motors) place.robot.drive(motor);
    for (const auto &color : outputs.colors) place.robot.show(color.rgb, color.at);
    for (const auto &edge : outputs.light) switch_lamp(place.lamp, edge.at, edge.on);
    rest(place.lamp, until);
    for (const auto &serial : outputs.serial)
        if (ends_line(place.line, serial.byte))
            place.robot.report(serial.at, place.board.tick(), EventKind::PRINT,
                               std::exchange(place.line, {}));
    for (const auto &[at, reset] : outputs.resets)
        place.robot.report(at, place.board.tick(), EventKind::NOTE, reset.text());
    outputs.clear();
    if (place.failed || place.board.failure().empty()) return;
    place.failed = true;
    place.robot.crash(place.board.now(), place.board.tick(), place.board.failure(),
                      place.board.failure_code());
}

void Boards::execute(ModulePlace &module, Cycles until) {
    ModuleBoard &board = *module.board;
    board.run(until);
    for (const auto &edge : board.lights) switch_lamp(module.lamps[edge.cell], edge.at, edge.on);
    for (Lamp &lamp : module.lamps) rest(lamp, until);
    for (const auto &output : board.can_frames)
        queued_.push_back({module.index, {output.at + QUANTUM, output.frame}});
    auto report = [&](Cycles at, EventKind kind, std::string text, CodePath code = {}) {
        module_events_.push_back({at, module.index, board.tick(), module_flash_->name(), kind,
                                  std::move(text), std::move(code)});
    };
    for (const auto &serial : board.serial)
        if (ends_line(module.line, serial.byte))
            report(serial.at, EventKind::PRINT, std::exchange(module.line, {}));
    for (const auto &[at, reset] : board.resets) report(at, EventKind::NOTE, reset.text());
    board.lights.clear();
    board.can_frames.clear();
    board.serial.clear();
    board.resets.clear();
    Cycles rest = NEVER;
    for (const Lamp &lamp : module.lamps) rest = std::min(rest, rest_of(board, lamp));
    modules_rest_[module.index] = rest;
    if (module.failed || board.failure().empty()) return;
    module.failed = true;
    report(board.now(), EventKind::CRASH, board.failure(), board.failure_code());
}

/// Edges of an IR LED become flashes. One that is still on is passed on as far as it has lasted.
void Boards::switch_lamp(Lamp &lamp, Cycles at, bool on) {
    if (on) {
        lamp.on_since = at;
        lamp.begins = true;
    } else if (lamp.on_since != NEVER) {
        add_flash(lamp, at);
        lamp.on_since = NEVER;
    }
}

void Boards::add_flash(Lamp &lamp, Cycles end) {
    const Cycles begin = lamp.on_since;
    end = std::max(end, begin + RobotBoard::SEEN_PULSE);
    Flash out = {begin + QUANTUM, end + QUANTUM, lamp.station, lamp.begins, false, {}, {}};
    if (out.begins) out.found = lamp.reader.pulse(begin);
    lamp.begins = false;
    if (out.found == PulseReader::Found::BEGIN && !is_cell(lamp.station))
        place(lamp.station).spoils = true;
    if (out.found == PulseReader::Found::MESSAGE) out.message = lamp.reader.message();
    flashes_.push_back(out);
}

void Boards::rest(Lamp &lamp, Cycles until) {
    if (lamp.on_since != NEVER) {
        add_flash(lamp, until);
        lamp.on_since = until;
    }
    if (lamp.reader.torn_off(until)) {
        lamp.reader.reset();
        flashes_.push_back({until + QUANTUM, until + QUANTUM, lamp.station, false, true, {}, {}});
    }
}

Boards::Flash Boards::take_flash() {
    const Flash flash = flashes_.front();
    flashes_.pop_front();
    return flash;
}

void Boards::forget_reached(uint32_t station) {
    if (reached_.size() <= station) reached_.resize(station + 1);
    reached_[station].clear();
}

void Boards::reach(uint32_t station, uint32_t listener, distance_measurement_t strength, bool lost,
                   uint64_t draw) {
    // Behind the leader and the first start pulse, so that the rest is still taken for a message.
    constexpr unsigned FIRST_TO_LOSE = 3, LEAST_PULSES = 26;
    const auto which = static_cast<unsigned>(FIRST_TO_LOSE + draw % (LEAST_PULSES - FIRST_TO_LOSE));
    if (!is_cell(listener)) place(listener).spoils = true;
    reached_[station].push_back({listener, strength, lost ? which : NO_PULSE});
}

void Boards::pulse(uint32_t station, Cycles begin, Cycles end, bool begins) {
    if (!reaches_any(station)) return;
    for (Reached &reached : reached_[station]) {
        reached.pulses += begins;
        if (reached.pulses - 1 != reached.lost_pulse)
            shine(reached.listener, {begin, end, reached.strength});
    }
}

void Boards::shine(uint32_t station, const LightPulse &pulse) {
    if (!is_cell(station)) return up_to_date(place(station)).shine(pulse);
    ModulePlace &module = module_of(station);
    if (module.powered) up_to_date(module).shine(cell_of(station), pulse);
}

void Boards::first_pulse(uint32_t station, Cycles at) {
    pulse(station, at, at + RobotBoard::SEEN_PULSE);
}

void Boards::other_pulses(uint32_t station, Cycles at, const message_t &message) {
    if (!reaches_any(station)) return;
    for (Cycles offset : pulses_of(message))
        if (offset > 0) pulse(station, at + offset, at + offset + RobotBoard::SEEN_PULSE);
}

void Boards::hold_busy() {
    constexpr Cycles FOR_EVER = Cycles{1} << 60;
    for (Place &place : places_) up_to_date(place).shine({0, FOR_EVER, RobotReceiver::FROM_ABOVE});
    for (ModulePlace &module : modules_)
        for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++)
            up_to_date(module).shine(cell, {0, FOR_EVER, RobotReceiver::FROM_ABOVE});
}

// Modules

void Boards::add(uint8_t x, uint8_t y, Cycles tick, Cycles power_up) {
    const auto index = static_cast<uint32_t>(modules_.size());
    ModulePlace &module = modules_.emplace_back();
    module.index = index;
    modules_rest_.push_back(0);
    module.tick = tick;
    module.eeprom = ModuleBoard::eeprom_of(x, y);
    module.board.emplace(*module_flash_, index, module.eeprom, tick, power_up, context_.chance);
    const auto first = static_cast<uint32_t>(robots_.size()) + GridLayout::MODULE_CELLS * index;
    for (uint32_t cell = 0; cell < CELLS_PER_MODULE; cell++) module.lamps.push_back({first + cell});
}

/// A power cycle if it is on already.
void Boards::set_power(uint32_t index, Cycles at, bool on) {
    ModulePlace &module = modules_[index];
    if (module.powered) module.eeprom = module.board->eeprom();
    module.powered = on;
    module.on_bus = false;
    modules_rest_[index] = on ? 0 : NEVER;
    module.failed = false;
    module.line.clear();
    for (Lamp &lamp : module.lamps) lamp.on_since = NEVER;
    std::erase_if(queued_, [index](const QueuedFrame &frame) { return frame.module == index; });
    if (!on) return;
    module.board.emplace(*module_flash_, index, module.eeprom, module.tick, std::max(at, now_),
                         context_.chance);
}

void Boards::pass_frames(ModuleNodes &nodes) {
    for (ModulePlace &module : modules_) {
        if (!module.on_bus || nodes.queued(module.index) > 0) continue;
        module.on_bus = false;  // its node went bus-off
        if (!module.powered) continue;
        const CanErrors errors = nodes.errors(module.index);
        up_to_date(module).set_can_errors(errors.transmit, errors.receive, true);
        up_to_date(module).frame_lost();
    }
    std::erase_if(queued_, [&](const QueuedFrame &frame) {
        if (!modules_[frame.module].powered) return true;
        if (!nodes.sends(frame.module)) return false;
        nodes.queue(frame.module, frame.output);
        modules_[frame.module].on_bus = true;
        return true;
    });
}

void Boards::frame_sent(uint32_t module, Cycles at) {
    modules_[module].on_bus = false;
    if (modules_[module].powered) up_to_date(modules_[module]).frame_sent(at);
}

void Boards::receive_can(uint32_t module, Cycles at, const CanFrame &frame,
                         const CanErrors &errors) {
    if (!modules_[module].powered) return;
    ModuleBoard &board = up_to_date(modules_[module]);
    board.set_can_errors(errors.transmit, errors.receive, errors.bus_off);
    board.receive_can(at, frame);
}

CellLight Boards::light(uint32_t module, uint8_t cell, Cycles /*at*/) {
    return modules_[module].powered ? modules_[module].board->light(cell) : CellLight{};
}

ModuleDriver::About Boards::about(uint32_t module) {
    ModulePlace &place = modules_[module];
    const uint32_t ticks = place.powered ? up_to_date(place).tick() : place.board->tick();
    return {"on a board", place.failed, ticks, 0, place.board->frames_missed()};
}

}  // namespace kilotwin
