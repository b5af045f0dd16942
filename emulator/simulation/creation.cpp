// Puts a simulation together: robots, bodies, channel and stations, as the definition asks for.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <utility>

#include "avr/boards/board_stations.h"
#include "avr/boards/chip_driver.h"
#include "base/errors.h"
#include "grid/cell_stations.h"
#include "infrared/ideal_channel.h"
#include "infrared/kilobot_channel.h"
#include "physics/placement.h"
#include "robots/native/driver.h"
#include "robots/translated/driver.h"
#include "simulation/simulation.h"

namespace kilotwin {

namespace {

// Robots are switched on within a message period of one another, and at least so long before RUN.
constexpr uint32_t POWER_UP_TICKS = 16;
constexpr int64_t LEAD_TICKS = 64;

/// The file outlives this process: the parent reads in it which robot ran last. It stays mapped,
/// for the process's next simulation: one that is confined maps no file any more once programs ran.
BlackBox *map_black_box(const std::string &path) {
    static std::map<std::string, BlackBox *> mapped;
    if (path.empty()) return nullptr;
    if (const auto found = mapped.find(path); found != mapped.end()) return found->second;
    int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
    if (file < 0) throw EngineError("cannot open " + path + ": " + std::strerror(errno));
    void *memory = mmap(nullptr, sizeof(BlackBox), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) throw EngineError("cannot map " + path + ": " + std::strerror(errno));
    return mapped[path] = static_cast<BlackBox *>(memory);
}

/// Whole world steps, however long these are.
int64_t whole_steps(int64_t ticks) { return (ticks + 3) / 4 * 4; }
Cycles round_up(int64_t ticks) { return static_cast<Cycles>(whole_steps(ticks)) * TICK_CYCLES; }

/// When RUN is given: after the lead, and after every command that comes before RUN.
Cycles run_cycles(const SimulationDef &def) {
    int64_t lead = LEAD_TICKS + def.lead_ticks;
    for (const auto &command : def.commands)
        lead = std::max(lead, 2 * POWER_UP_TICKS - command.tick);
    return round_up(lead);
}

/// The image of a robot on a board; EngineError if it is none.
std::shared_ptr<const FlashImage> robots_image(const std::string &file) {
    auto flash = FlashImage::load(file);
    if (flash->is_overhead_controllers())
        throw EngineError(file + ": an overhead controller's program, which listens to the serial "
                                 "line and not to infrared; name a robot's");
    return flash;
}

}  // namespace

Simulation::Simulation(const SimulationDef &def)
    : def_(def),
      chance_(def.seed),
      step_(def.step_ticks * TICK_CYCLES),
      run_at_(run_cycles(def)),
      start_(run_at_ - round_up(def.lead_ticks)),
      now_(0),
      next_sample_(run_at_),
      black_box_(map_black_box(def.black_box)),
      team_(threads_of(def), GuestStack::prepare_this_thread),
      boards_(robots_, create_shares()),
      commands_(def.commands, run_at_),
      faults_(def.faults, run_at_),
      bodies_(create_bodies(create_robots())),
      floor_(def.floor, run_at_, step_, def_.arena, def.profile.radius_m, bodies_),
      wake_(robots_.size(), 0) {
    for (const RobotFault &fault : def.faults) slot_of(fault.robot);
    if (def.grid)
        grid_.emplace(*def.grid, chance_, POWER_UP_TICKS * TICK_CYCLES, run_at_, def.run_ahead,
                      create_module_driver(*def.grid));
    if (def.kilobot_medium)
        create_kilobot_channel();
    else
        create_ideal_channel();
    // Its port is opened before a guest runs, from when on no port can be (base/confinement.h).
    RobotBoard *debugged = def.debugged ? &boards_.board_of(def.debugged->robot) : nullptr;
    if (debugged != nullptr) debugged->listen_for_debugger(def.debugged->port);
    boot();
    if (debugged != nullptr) debugged->serve_debugger();
}

Simulation::Share::Share(uint32_t number, const Chance &chance, const SimulationDef &def,
                         BlackBox *black_box)
    : context{.chance = chance,
              .events = events,
              .emissions = emissions,
              .black_box = black_box == nullptr ? nullptr : &black_box->share[number],
              .frame = def.kilobot_medium ? FRAME_CYCLES : 0,
              .gains_are_mm = !def.kilobot_medium,
              .battery = static_cast<Cycles>(def.battery_h * 3600 * CYCLES_PER_SECOND),
              .readings = def.readings,
              .recalls_passes = def.recalls_passes,
              .share = number} {}

/// Fewer than asked for where more threads cannot help. A program that notes which of its code has
/// run has one place for that.
uint32_t Simulation::threads_of(const SimulationDef &def) {
    size_t most = 0;
    for (const auto &group : def.groups) most += group.count;
    most = std::clamp<size_t>(most, 1, std::min(def.threads, BlackBox::MOST_SHARES));
    if (most == 1) return 1;
    auto is_covered = [](const SimulationDef::Group &group) {
        return group.tier == Tier::TRANSLATED
                   ? TranslatedProgram::load(group.program, group.name).is_covered()
                   : Program::load(group.program, group.name).is_covered();
    };
    for (const auto &group : def.groups)
        if (is_on_board(group.tier) || is_covered(group)) return 1;
    return static_cast<uint32_t>(most);
}

/// Returns the context of what is no guest.
const RobotContext &Simulation::create_shares() {
    for (uint32_t share = 0; share < team_.size(); share++)
        shares_.emplace_back(share, chance_, def_, black_box_);
    if (black_box_ != nullptr) black_box_->shares = team_.size();
    return shares_.front().context;
}

int64_t Simulation::first_tick(const SimulationDef &def) { return -whole_steps(def.lead_ticks); }

Simulation::~Simulation() = default;

Simulation::Places Simulation::create_robots() {
    std::vector<Pose> given, poses;
    for (const auto &group : def_.groups)
        given.insert(given.end(), group.poses.begin(), group.poses.end());
    const double radius_m = def_.profile.radius_m;
    const auto objects = place_objects(def_.objects, given, def_.arena, radius_m, chance_);
    for (const auto &group : def_.groups)
        if (group.poses.empty())
            place_uniformly(poses, group.count, def_.arena, radius_m, chance_, objects);
        else
            poses.insert(poses.end(), group.poses.begin(), group.poses.end());
    if (poses.empty()) throw EngineError("there is no robot");
    if (!def_.lab.empty() && def_.lab.size() != poses.size())
        throw EngineError("a lab has as many robots as there are, or none");
    slots_ = slots_for(poses);
    std::vector<uint32_t> first;                           // robot of each group
    std::vector<std::shared_ptr<const FlashImage>> flash;  // of each group; null: not on boards
    uint32_t robots = 0;
    for (const auto &group : def_.groups) {
        first.push_back(robots);
        flash.push_back(is_on_board(group.tier) ? robots_image(group.program) : nullptr);
        drivers_.push_back(make_driver(group, robots));
        robots += static_cast<uint32_t>(group.count);
    }
    Places places = {{}, objects};
    robots_.reserve(poses.size());
    for (uint32_t slot = 0; slot < poses.size(); slot++) {
        const uint32_t index = slots_.index_in(slot);
        const auto next = std::upper_bound(first.begin(), first.end(), index);
        const auto group = static_cast<size_t>(next - first.begin()) - 1;
        auto power_up = static_cast<Cycles>(chance_.uniform(index, Purpose::POWER_UP, 0) *
                                            static_cast<double>(POWER_UP_TICKS * TICK_CYCLES));
        RobotContext &context = shares_[team_.share_of(slot, poses.size())].context;
        robots_.emplace_back(context, *drivers_[group], index, calibrate(index), power_up);
        if (flash[group]) boards_.add(slot, *flash[group], power_up);
        robots_.back().set_light(def_.light.at(poses[index].position, def_.arena));
        places.poses.push_back(poses[index]);
    }
    return places;
}

// Boards are few, and refer to one another by index.
Slots Simulation::slots_for(const std::vector<Pose> &poses) const {
    const bool has_boards =
        std::any_of(def_.groups.begin(), def_.groups.end(),
                    [](const SimulationDef::Group &group) { return is_on_board(group.tier); });
    const bool by_their_place = !has_boards && poses.size() >= def_.kept_by_place_from;
    return by_their_place ? Slots(by_place(poses)) : Slots(poses.size());
}

// Robots of a group share a program. `first` is the first robot of the group, for events.
std::unique_ptr<Driver> Simulation::make_driver(const SimulationDef::Group &group, uint32_t first) {
    if (is_on_board(group.tier))
        return std::make_unique<ChipDriver>(group.tier, group.name, group.program);
    if (group.tier == Tier::TRANSLATED)
        return std::make_unique<TranslatedDriver>(
            TranslatedProgram::load(group.program, group.name), group.count, team_.size());
    std::vector<Program *> programs;
    programs.reserve(team_.size());
    for (uint32_t share = 0; share < team_.size(); share++)
        programs.push_back(&Program::load(group.program, group.name, share));
    if (const std::string handlers = programs.front()->own_handlers(); !handlers.empty())
        events_.push_back({0, first, 0, group.name, EventKind::NOTE,
                           "its own interrupt handlers are never called here: " + handlers});
    return std::make_unique<NativeDriver>(std::move(programs), group.count);
}

// Spreads are cut at three standard deviations, so that no robot is an extreme one. A lab's robot
// has its own EEPROM; oscillator and motors are drawn all the same: no file says what they do.
Calibration Simulation::calibrate(uint32_t index) const {
    constexpr double LIMIT = 3;
    auto spread = [&](Purpose purpose, double sd) {
        return 1 + sd * std::clamp(chance_.normal(index, purpose, 0), -LIMIT, LIMIT);
    };
    const auto tick = static_cast<Cycles>(
        std::llround(static_cast<double>(TICK_CYCLES) * spread(Purpose::CLOCK, def_.clock_spread)));
    const InfraredGains gains(spread(Purpose::SENSITIVITY, def_.sensitivity_spread));
    if (!def_.lab.empty()) {
        const auto &of = def_.lab[index];
        return {tick,
                of.uid,
                of.turn_left,
                of.turn_right,
                of.straight_left,
                of.straight_right,
                of.gains ? InfraredGains(*of.gains) : gains};
    }
    const auto &p = def_.profile;
    return {tick,
            static_cast<uint16_t>(index + 1),
            p.turn_left,
            p.turn_right,
            p.straight_left,
            p.straight_right,
            gains};
}

ModuleDriver &Simulation::create_module_driver(const Grid::Settings &grid) {
    if (is_on_board(grid.tier)) {
        boards_.load_module(grid.program);
        return boards_;
    }
    guest_modules_.emplace(grid.program, grid.name, grid.columns * grid.rows, chance_,
                           !def_.kilobot_medium);
    return *guest_modules_;
}

Bodies Simulation::create_bodies(const Places &places) {
    const double radius = def_.profile.radius_m;
    const double reach_m =
        def_.kilobot_medium ? KilobotChannel::reach_m(*def_.kilobot_medium) : def_.range_m;
    // A robot hides others that are within reach even where its centre is not.
    const double hides_m = !def_.kilobot_medium && def_.line_of_sight ? radius : 0;
    const double senses_m = def_.floor ? 2 * radius + def_.floor->obstacle_m : 0;
    return Bodies(def_.arena, def_.profile, chance_, slots_, team_, step_, start_, places.poses,
                  std::max(reach_m + hides_m, senses_m), places.objects);
}

// Kinds are added in the order in which they are executed where they are due at the same time.
void Simulation::create_kilobot_channel() {
    const auto robots = static_cast<uint32_t>(robots_.size());
    const uint32_t cells = grid_ ? grid_->layout().cells() : 0;
    const auto beacons = static_cast<uint32_t>(def_.beacons.size());
    auto channel = std::make_unique<KilobotChannel>(
        *def_.kilobot_medium,
        ChannelContext{chance_, robots_, bodies_, team_, step_, def_.run_ahead, def_.overhead,
                       trail_},
        beacons + cells, !floor_.exists() && may_run_ahead(),
        [this](uint32_t robot, Cycles until) { ran_ahead(robot, until); });
    if (!boards_.empty())
        stations_.push_back(std::make_unique<BoardRobots>(boards_, *channel, chance_));
    // Behind the robots and before the cells, which take all that follows for theirs.
    if (beacons > 0) {
        stations_.push_back(std::make_unique<KilobotBeacons>(
            def_.beacons, def_.kilobot_medium->range_m, *channel, bodies_, chance_, robots));
        channel->assign(*stations_.back(), robots, beacons);
    }
    const uint32_t first_cell = robots + beacons;
    if (grid_ && guest_modules_)
        stations_.push_back(std::make_unique<GuestCells>(*grid_, *guest_modules_, *channel, bodies_,
                                                         chance_, first_cell));
    else if (grid_)
        stations_.push_back(
            std::make_unique<BoardCells>(*grid_, boards_, *channel, bodies_, chance_, first_cell));
    if (grid_) channel->assign(*stations_.back(), first_cell, cells);
    for (auto &kind : stations_) channel->add(*kind);
    channel_ = std::move(channel);
}

void Simulation::create_ideal_channel() {
    if (!boards_.empty())
        throw EngineError("boards need the kilobot medium: the ideal one has no pulses");
    auto channel = std::make_unique<IdealChannel>(
        IdealChannel::Settings{def_.range_m, def_.line_of_sight, def_.profile.radius_m},
        ChannelContext{chance_, robots_, bodies_, team_, step_, def_.run_ahead, def_.overhead,
                       trail_});
    if (!def_.beacons.empty())
        stations_.push_back(
            std::make_unique<IdealBeacons>(def_.beacons, def_.range_m, *channel, chance_));
    if (grid_) stations_.push_back(std::make_unique<IdealCells>(*grid_, *channel));
    for (auto &kind : stations_) channel->add(*kind);
    channel_ = std::move(channel);
}

// From power-up to RUN robots wait on their places for what the host orders.
void Simulation::boot() {
    NativeGuest::serve_this_thread();
    note_work(true);
    give_commands(start_);
    team_.share(robots_.size(), [this](uint32_t /*share*/, size_t begin, size_t end) {
        for (size_t slot = begin; slot < end; slot++) robots_[slot].run(start_);
        for (size_t slot = begin; slot < end; slot++) robots_[slot].count_on(def_.on_ticks);
    });
    channel_->boot(start_);
    for (uint32_t robot : boards_.robots()) wake_[robot] = NEVER;  // the channel executes them
    for (auto &robot : robots_) robot.emissions().clear();
    for (auto &robot : robots_) robot.motor_commands().clear();
    now_ = start_;
    sample_if_due();
    note_work(false);
}

}  // namespace kilotwin
