#include "engine/simulation.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "engine/message_crc.h"
#include "engine/placement.h"
#include "engine/trigonometry.h"

namespace kilotwin {

namespace {

constexpr uint32_t POWER_UP_TICKS =
    16;                             // robots are switched on within a message period of one another
constexpr int64_t LEAD_TICKS = 64;  // and at least so long before RUN
// Who is near which cell is looked up so often: rarely enough to cost little, often enough that few
// cells seem to have somebody near.
constexpr Cycles LOOK_AROUND_GRID = 16 * TICK_CYCLES;
constexpr double SKIN_SHARE = 0.4;  // of the medium's range
constexpr double SKIN_USED =
    0.6;  // of the skin, before new lists are made: the rest is for running ahead
constexpr double CONTACT_MARGIN = 0.05;  // of a radius
constexpr uint8_t STEPS_APART_TO_LEAVE = 4;
constexpr uint32_t STEPS_TOUCHING_TO_CARE = 4;
constexpr double TOUCHING = 0.001;  // of a diameter
// A robot that is pushed may be faster than it drives: the solver's own limit, relative to the
// drive's speed.
constexpr double PUSHED_SPEED = 2;

// Two robots approach one another at most so fast: one drives, the other may be pushed.
constexpr double CLOSING_SPEED = 1 + PUSHED_SPEED;

BlackBox *map_black_box(const std::string &path) {
    int file = open(path.c_str(), O_RDWR | O_CLOEXEC);
    if (file < 0) throw EngineError("cannot open " + path + ": " + std::strerror(errno));
    void *memory = mmap(nullptr, sizeof(BlackBox), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) throw EngineError("cannot map " + path + ": " + std::strerror(errno));
    return static_cast<BlackBox *>(memory);
}

/// Whole world steps, however long these are.
Cycles round_up(int64_t ticks) { return static_cast<Cycles>((ticks + 3) / 4 * 4) * TICK_CYCLES; }

Cycles run_cycles(const SimulationDef &def) {
    int64_t lead = LEAD_TICKS + def.lead_ticks;
    for (const auto &command : def.commands)
        lead = std::max(lead, 2 * POWER_UP_TICKS - command.tick);
    return round_up(lead);
}

size_t count_robots(const SimulationDef &def) {
    size_t count = 0;
    for (const auto &group : def.groups) count += group.count;
    return count;
}

}  // namespace

Simulation::Simulation(const SimulationDef &def)
    : def_(def),
      chance_(def.seed),
      step_(def.step_ticks * TICK_CYCLES),
      run_at_(run_cycles(def)),
      start_(run_at_ - round_up(def.lead_ticks)),
      chassis_(def.profile, chance_, count_robots(def)),
      next_sample_(run_at_),
      reach_m_(def.kilobot_medium ? KilobotMedium::reach_m(*def.kilobot_medium) : def.range_m),
      contact_gap_m_(2 * PUSHED_SPEED * chassis_.fastest_m_s() * seconds(step_) +
                     CONTACT_MARGIN * def.profile.radius_m),
      black_box_(def.black_box.empty() ? nullptr : map_black_box(def.black_box)),
      context_{chance_,
               events_,
               emissions_,
               black_box_,
               def.kilobot_medium ? FRAME_CYCLES : 0,
               !def.kilobot_medium,
               static_cast<Cycles>(def.battery_h * 3600 * CYCLES_PER_SECOND),
               def.temperature},
      commands_(def.commands),
      wake_(count_robots(def), 0),
      next_ask_(wake_.size(), 0),
      next_motor_(wake_.size(), NEVER),
      motor_index_(wake_.size(), 0),
      still_since_(wake_.size(), 0),
      audience_at_(wake_.size(), NEVER),
      surroundings_(wake_.size()),
      steps_apart_(wake_.size(), 0),
      in_contact_(wake_.size(), false),
      neighbours_(
          std::max(reach_m_ + def.profile.radius_m, 2 * def.profile.radius_m + contact_gap_m_ +
                                                        (def.floor ? def.floor->obstacle_m : 0)),
          SKIN_SHARE * reach_m_),
      medium_(def.range_m, def.line_of_sight, def.profile.radius_m, wake_.size()),
      world_(def.arena, def.profile, chassis_.fastest_m_s(), wake_.size()) {
    if (wake_.empty()) throw EngineError("there is no robot");
    if (def.floor) floor_.emplace(*def.floor, run_at_, step_, wake_.size());
    std::stable_sort(commands_.begin(), commands_.end(),
                     [](const auto &a, const auto &b) { return a.tick < b.tick; });
    create_robots();
    if (def.grid)
        grid_.emplace(*def.grid, chance_, POWER_UP_TICKS * TICK_CYCLES, run_at_,
                      !def.kilobot_medium, def.run_ahead);
    if (def.kilobot_medium)
        kilobot_medium_.emplace(*def.kilobot_medium, chance_, robots_, emissions_,
                                statistics_.medium, grid_ ? &*grid_ : nullptr);
    boot();
}

Simulation::~Simulation() {
    if (black_box_ != nullptr) munmap(black_box_, sizeof *black_box_);
}

void Simulation::create_robots() {
    std::vector<Pose> poses;
    for (const auto &group : def_.groups)
        if (group.poses.empty())
            place_uniformly(poses, group.count, def_.arena, def_.profile.radius_m, chance_);
        else
            poses.insert(poses.end(), group.poses.begin(), group.poses.end());
    uint32_t index = 0;
    for (const auto &group : def_.groups) {
        auto program = Program::load(group.program, group.name);
        size_t stride = (program->state_bytes() + 63) / 64 * 64;
        images_.emplace_back(new uint8_t[stride * group.count]);
        for (size_t i = 0; i < group.count; i++, index++) {
            auto power_up = static_cast<Cycles>(chance_.uniform(index, Purpose::POWER_UP, 0) *
                                                static_cast<double>(POWER_UP_TICKS * TICK_CYCLES));
            Calibration calibration = calibrate(index);
            robots_.emplace_back(context_, program, index, calibration, power_up,
                                 images_.back().get() + i * stride);
        }
    }
    for (const auto &pose : poses) {
        trajectories_.emplace_back(start_, pose);
        positions_.push_back(pose.position);
    }
}

Calibration Simulation::calibrate(uint32_t index) const {
    constexpr double LIMIT = 3;
    auto spread = [&](Purpose purpose, double sd) {
        return 1 + sd * std::clamp(chance_.normal(index, purpose, 0), -LIMIT, LIMIT);
    };
    const auto &p = def_.profile;
    const double tick =
        static_cast<double>(TICK_CYCLES) * spread(Purpose::CLOCK, def_.clock_spread);
    return {static_cast<uint16_t>(index + 1),
            p.turn_left,
            p.turn_right,
            p.straight_left,
            p.straight_right,
            InfraredGains(spread(Purpose::SENSITIVITY, def_.sensitivity_spread)),
            static_cast<Cycles>(tick + 0.5)};
}

// From power-up to RUN robots wait on their places for what the host tells them.
void Simulation::boot() {
    Robot::serve_this_thread();
    give_commands(start_);
    for (auto &robot : robots_) robot.run(start_);
    emissions_.clear();
    for (auto &robot : robots_) robot.motor_commands.clear();
    now_ = start_;
    if (grid_)  // nobody listens yet
        while (auto module = grid_->run(now_))
            grid_->answer(*module, grid_->module(*module).outgoing().at, Module::Answer::SENT);
    neighbours_.rebuild(positions_);
    listed_at_ = positions_;
}

int64_t Simulation::tick_of(Cycles at) const {
    return (static_cast<int64_t>(at) - static_cast<int64_t>(run_at_)) /
           static_cast<int64_t>(TICK_CYCLES);
}

int64_t Simulation::tick() const { return tick_of(now_); }

void Simulation::advance(int64_t ticks) {
    Robot::serve_this_thread();
    const Cycles end = end_of_step(now_ + static_cast<Cycles>(ticks) * TICK_CYCLES);
    if (grid_) grid_->no_host_before(end);
    sample_if_due();
    while (now_ < end) {
        step(std::min(end, next_sample_));
        sample_if_due();
    }
}

void Simulation::step(Cycles limit) {
    give_commands(now_ + step_);
    if (next_command_ < commands_.size())
        limit = std::min(
            limit, std::max(now_ + step_, begin_of_step(command_time(commands_[next_command_]))));
    refresh_lists();
    if (grid_ && (now_ - start_) % LOOK_AROUND_GRID == 0) look_around_grid();
    if (floor_) next_sensing_ = floor_->senses_at(now_) ? now_ : floor_->next_sensing(now_);
    for (uint32_t robot = 0; robot < robots_.size(); robot++)
        if (wake_[robot] <= now_) attend(robot, limit);
    if (kilobot_medium_)
        kilobot_medium_->run(together_, now_, now_ + step_, neighbours_, positions_);
    else if (grid_)
        run_grid();
    deliver_frames();
    take_over_plans();
    move();
    now_ += step_;
    statistics_.steps++;
}

Cycles Simulation::command_time(const SimulationDef::Command &command) const {
    return run_at_ +
           static_cast<Cycles>(command.tick) * TICK_CYCLES;  // negative ticks wrap as they should
}

Cycles Simulation::begin_of_step(Cycles at) const { return at - (at - run_at_) % step_; }
Cycles Simulation::end_of_step(Cycles at) const { return begin_of_step(at + step_ - 1); }

/// Hands out the commands before `until`.
void Simulation::give_commands(Cycles until) {
    for (; next_command_ < commands_.size() && command_time(commands_[next_command_]) < until;
         next_command_++)
        give(commands_[next_command_], std::max(command_time(commands_[next_command_]), now_));
}

void Simulation::give(const SimulationDef::Command &command, Cycles at) {
    for (auto &robot : robots_) {
        if (robot.uid() < command.uid_first || robot.uid() > command.uid_last) continue;
        if ((positions_[robot.index()] - command.centre).norm() > command.radius_m) continue;
        robot.receive({at, command.message, {}});
        next_ask_[robot.index()] = std::min(next_ask_[robot.index()], at);  // it may be told to run
    }
}

void Simulation::send(const SimulationDef::Command &command) { give(command, now_); }

void Simulation::refresh_lists() {
    if (2 * drift_m_ <= SKIN_USED * neighbours_.skin_m()) return;
    neighbours_.rebuild(positions_);
    listed_at_ = positions_;
    statistics_.list_rebuilds++;
    drift_m_ = 0;
    for (uint32_t robot = 0; robot < robots_.size(); robot++)
        if (neighbours_.changed(robot)) audience_at_[robot] = NEVER;
}

/// How long nobody can come near who is on no list.
double Simulation::lists_hold_for_s() const {
    return (neighbours_.skin_m() - 2 * drift_m_) / (CLOSING_SPEED * chassis_.fastest_m_s());
}

void Simulation::attend(uint32_t robot, Cycles limit) {
    auto &around = surroundings_[robot];
    if (around.look_again <= now_ || !def_.run_ahead) look_around(robot);
    Cycles until = std::min({limit, around.alone_until, silent_until(robot)});
    const bool light_changes =
        !def_.light.sources.empty() && !trajectories_[robot].drive().stands();
    // A cell may speak to it any time.
    until =
        def_.run_ahead && !light_changes && !grid_ ? std::max(until, now_ + step_) : now_ + step_;
    if (next_sensing_ < until) floor_->tell(robots_[robot], around.cell, next_sensing_, until);
    attended_.push_back(robot);
    robots_[robot].light = def_.light.at(positions_[robot]);
    const bool together =
        kilobot_medium_ && (until == now_ + step_ || kilobot_medium_->claims(robot));
    if (together) {
        wake_[robot] = now_ + step_;
        together_.push_back(robot);
    } else {
        wake_[robot] = until;
        run_robot(robot, until);
    }
}

/// The begin of the first step in which the robot, or anybody in its reach, may send: who may not
/// yet be asked for a message cannot be heard.
Cycles Simulation::silent_until(uint32_t robot) const {
    const auto &around = surroundings_[robot];
    if (around.in_reach.empty()) return NEVER;
    Cycles first = next_ask_[robot];
    for (uint32_t other : around.in_reach) first = std::min(first, next_ask_[other]);
    return first == NEVER ? NEVER : begin_of_step(std::max(first, now_));
}

/// What stands around a robot at rest or on its way, and how long it can be left alone: bounded by
/// the fastest that anybody can come nearer.
void Simulation::look_around(uint32_t robot) {
    auto &around = surroundings_[robot];
    const auto &trajectory = trajectories_[robot];
    const Eigen::Vector2d here = positions_[robot];
    const double speed = chassis_.fastest_m_s(), radius = def_.profile.radius_m;
    const double obstacle_gap = floor_ ? floor_->obstacle_m() : 0;
    const double sensed_gap = std::max(obstacle_gap, contact_gap_m_);
    const bool at_rest = trajectory.drive().at_rest() && !world_.holds(robot);
    const Eigen::Vector2d ahead = trajectory.ahead(now_);

    double alone_s = lists_hold_for_s(), unchanged_s = alone_s;
    bool obstacle = false, crowded = false;
    around.in_reach.clear();
    for (uint32_t other : neighbours_.of(robot)) {
        const Eigen::Vector2d offset = positions_[other] - here;
        double distance = offset.norm(), gap = distance - 2 * radius;
        if (gap <= obstacle_gap && offset.dot(ahead) > 0) obstacle = true;
        if (gap <= contact_gap_m_) crowded = true;
        double change_m = std::max(gap - sensed_gap, 0.0);
        if (distance > reach_m_)
            change_m = std::min(change_m, distance - reach_m_);
        else
            around.in_reach.push_back(other);
        alone_s = std::min(alone_s, change_m / (CLOSING_SPEED * speed));
        bool other_moves = !trajectories_[other].drive().at_rest() || world_.holds(other);
        if (other_moves) unchanged_s = std::min(unchanged_s, change_m / (CLOSING_SPEED * speed));
    }
    double wall_gap = INFINITY;
    def_.arena.for_each_wall(here, [&](double distance, const Eigen::Vector2d &outward) {
        double gap = distance - radius;
        wall_gap = std::min(wall_gap, gap);
        if (gap <= obstacle_gap && outward.dot(ahead) > 0) obstacle = true;
        if (gap <= contact_gap_m_) crowded = true;
    });
    alone_s = std::min(alone_s, std::max(wall_gap - sensed_gap, 0.0) / speed);
    if (floor_) {
        around.cell.site = def_.arena.site_at(here);
        around.cell.flags = obstacle ? WIRE_CELL_OBSTACLE : 0;
        alone_s = std::min(alone_s, def_.arena.distance_to_site_edge(here) / speed);
    }
    around.crowded = crowded;
    around.alone_until = now_ + whole_steps(alone_s);
    around.look_again =
        at_rest ? now_ + std::max(whole_steps(unchanged_s), step_) : around.alone_until;
}

/// World steps that lie wholly within `for_s` seconds.
Cycles Simulation::whole_steps(double for_s) const {
    return static_cast<Cycles>(for_s / seconds(step_)) * step_;
}

void Simulation::run_robot(uint32_t index, Cycles until) {
    auto &robot = robots_[index];
    emissions_.clear();
    if (def_.run_ahead)
        robot.run(until);
    else
        for (Cycles at = now_ + TICK_CYCLES; at <= until; at += TICK_CYCLES) robot.run(at);
    // Beside the ideal medium's robots only those run so that nobody hears.
    for (const auto &emission : emissions_) {
        if (!kilobot_medium_ && emission.at < now_ + step_) {
            on_air_.push_back(emission);
            continue;
        }
        if (kilobot_medium_ && emission.at + FRAME_CYCLES > until) {
            kilobot_medium_->begin_unheard(emission);
            continue;
        }
        statistics_.medium.sent++;
        statistics_.medium.wrong_crc += !crc_is_right(emission.message);
    }
}

/// What the robots that ran mean to do. Not before all have: who runs later in a step must still
/// see what was to be expected at its begin.
void Simulation::take_over_plans() {
    for (uint32_t index : attended_) {
        const auto &commands = robots_[index].motor_commands;
        next_ask_[index] = robots_[index].next_ask();
        if (!commands.empty())
            next_motor_[index] = std::min(next_motor_[index], commands[motor_index_[index]].at);
    }
    attended_.clear();
    together_.clear();
}

void Simulation::look_around_grid() {
    const double way_m = PUSHED_SPEED * chassis_.fastest_m_s() * seconds(LOOK_AROUND_GRID);
    grid_->look_around(now_ + LOOK_AROUND_GRID, way_m, positions_);
}

/// Beside the ideal medium: robots within range hear each cell, from the next step on.
void Simulation::run_grid() {
    const Cycles end = now_ + step_;
    while (auto index = grid_->run(end)) {
        const CellEmission sent = grid_->module(*index).outgoing();
        const uint32_t cell = GridLayout::MODULE_CELLS * *index + sent.cell;
        const Cycles heard_at = std::max(sent.at + FRAME_CYCLES, end);
        for (uint32_t robot : grid_->robots_near(cell)) {
            const double distance = (positions_[robot] - grid_->layout().centre(cell)).norm();
            if (distance > grid_->infrared().cell_range_m || !crc_is_right(sent.message)) continue;
            const auto mm = static_cast<int16_t>(distance * 1000 + 0.5);
            robots_[robot].receive({heard_at, sent.message, {mm, mm}});
            statistics_.medium.received++;
        }
        grid_->answer(*index, sent.at, Module::Answer::SENT);
    }
}

bool Simulation::can_send(uint32_t bus, const CanFrame &frame) {
    return grid().can_send(now_, bus, frame);
}

Grid &Simulation::grid() {
    if (!grid_) throw EngineError("this run has no grid");
    return *grid_;
}

const Grid &Simulation::grid() const { return const_cast<Simulation *>(this)->grid(); }

/// Beside the ideal medium: the cell below a robot hears it, from the next step on.
void Simulation::deliver_to_grid(const Emission &emission) {
    const auto cell = grid_->layout().below(positions_[emission.robot]);
    if (!cell) return;
    const double distance = (positions_[emission.robot] - grid_->layout().centre(*cell)).norm();
    const auto mm = static_cast<int16_t>(distance * 1000 + 0.5);
    grid_->counts.received++;
    grid_->receive_ir(std::max(emission.at + FRAME_CYCLES, now_ + step_), *cell, emission.message,
                      {mm, mm}, !crc_is_right(emission.message));
}

void Simulation::deliver_frames() {
    std::sort(on_air_.begin(), on_air_.end(), [](const Emission &a, const Emission &b) {
        return a.at != b.at ? a.at < b.at : a.robot < b.robot;
    });
    for (const auto &emission : on_air_) {
        statistics_.medium.sent++;
        if (grid_) deliver_to_grid(emission);
        if (!crc_is_right(emission.message)) {
            statistics_.medium.wrong_crc++;
            continue;
        }
        if (!def_.run_ahead || !audience_holds(emission.robot)) {
            medium_.find_audience(emission.robot, neighbours_.of(emission.robot), positions_);
            audience_at_[emission.robot] = now_;
        }
        Reception reception = {
            std::max(emission.at + FRAME_CYCLES, now_ + step_), emission.message, {}};
        for (const auto &listener : medium_.last_audience(emission.robot)) {
            auto gain = static_cast<int16_t>(std::min<uint16_t>(listener.distance_mm, INT16_MAX));
            reception.distance = {gain, gain};
            robots_[listener.robot].receive(reception);
            statistics_.medium.received++;
        }
    }
    on_air_.clear();
}

/// Whether nobody who could matter has moved since the audience of `robot` was found.
bool Simulation::audience_holds(uint32_t robot) const {
    Cycles found = audience_at_[robot];
    if (found == NEVER || still_since_[robot] > found) return false;
    for (uint32_t other : neighbours_.of(robot))
        if (still_since_[other] > found) return false;
    return true;
}

void Simulation::move() {
    find_contacts();
    for (uint32_t robot = 0; robot < robots_.size(); robot++) {
        if (world_.holds(robot)) continue;
        if (next_motor_[robot] < now_ + step_) apply_commands(robot, trajectories_[robot]);
        if (!trajectories_[robot].drive().stands())
            place(robot, trajectories_[robot].position(now_ + step_));
    }
    solve_contacts();
}

void Simulation::place(uint32_t robot, const Eigen::Vector2d &position) {
    positions_[robot] = position;
    drift_m_ = std::max(drift_m_, (position - listed_at_[robot]).norm());
}

bool Simulation::moves_in_step(uint32_t robot) const {
    return !trajectories_[robot].drive().at_rest() || next_motor_[robot] < now_ + step_;
}

/// The robots that belong into the solver: whoever moves near a body or wall, and all who stand
/// near those in turn.
void Simulation::find_contacts() {
    const double reach = 2 * def_.profile.radius_m + contact_gap_m_;
    contacts_.clear();
    auto include = [&](uint32_t robot) {
        if (in_contact_[robot]) return;
        in_contact_[robot] = true;
        contacts_.push_back(robot);
    };
    for (uint32_t robot = 0; robot < robots_.size(); robot++)
        if (surroundings_[robot].crowded && moves_in_step(robot)) include(robot);
    for (size_t i = 0; i < contacts_.size(); i++) {
        const Eigen::Vector2d here = positions_[contacts_[i]];
        for (uint32_t other : neighbours_.of(contacts_[i]))
            if ((positions_[other] - here).squaredNorm() <= reach * reach) include(other);
    }
    std::sort(contacts_.begin(), contacts_.end());
    for (uint32_t robot : contacts_) {
        in_contact_[robot] = false;
        steps_apart_[robot] = 0;
        if (!world_.holds(robot)) world_.add(robot, trajectories_[robot], now_);
    }
    leaving_.clear();
    size_t next = 0;
    for (uint32_t robot : world_.robots()) {
        if (next < contacts_.size() && contacts_[next] == robot)
            next++;
        else if (++steps_apart_[robot] >= STEPS_APART_TO_LEAVE)
            leaving_.push_back(robot);
    }
    for (uint32_t robot : leaving_) world_.remove(robot);
}

/// Lets the motor commands of this step, and what changes by itself, take effect at their times.
void Simulation::apply_commands(uint32_t index, Trajectory &trajectory) {
    auto &commands = robots_[index].motor_commands;
    bool rested = trajectory.drive().at_rest();
    size_t &next = motor_index_[index];
    while (next_motor_[index] < now_ + step_) {
        const Cycles at = std::max(next_motor_[index], now_);
        const bool commanded = next < commands.size() && commands[next].at <= at;
        Drive drive =
            commanded ? chassis_.set_duties(index, at, commands[next].left, commands[next].right)
                      : chassis_.renew(index);
        next += commanded;
        next_motor_[index] = std::min(next < commands.size() ? commands[next].at : NEVER,
                                      chassis_.next_renewal(index));
        if (drive == trajectory.drive()) continue;
        bool halts = drive.stands() && !trajectory.drive().stands();
        trajectory.change(at, drive);
        still_since_[index] = !drive.stands() ? NEVER : halts ? now_ + step_ : still_since_[index];
        if (halts) place(index, trajectory.position(now_ + step_));
        surroundings_[index].look_again = std::min(surroundings_[index].look_again, now_ + step_);
    }
    if (next == commands.size()) {
        commands.clear();
        next = 0;
    }
    if (rested && !trajectory.drive().at_rest()) disturb_neighbours(index);
}

void Simulation::solve_contacts() {
    const auto &held = world_.robots();
    if (held.empty()) {
        touching_steps_ = 0;
        return;
    }
    const double step_s = seconds(step_);
    poses_before_.clear();
    free_shifts_.clear();
    for (uint32_t robot : held) {
        poses_before_.push_back(trajectories_[robot].pose(now_));
        apply_commands(robot, trajectories_[robot]);
        const Pose alone = trajectories_[robot].pose(now_ + step_), &before = poses_before_.back();
        free_shifts_.push_back(
            {alone.position - before.position, wrapped(alone.heading - before.heading)});
    }
    world_.step(free_shifts_, step_s, touching_steps_ >= STEPS_TOUCHING_TO_CARE);
    statistics_.solver_steps += held.size();
    for (size_t i = 0; i < held.size(); i++) {
        const uint32_t robot = held[i];
        Pose pose = poses_before_[i];
        const Shift shift = world_.moved(robot);
        bool moved = shift.by != Eigen::Vector2d::Zero();
        if (moved) {
            still_since_[robot] = trajectories_[robot].drive().stands() ? now_ + step_ : NEVER;
            disturb_neighbours(robot);
        }
        if (moved || shift.turn != 0)
            surroundings_[robot].look_again =
                std::min(surroundings_[robot].look_again, now_ + step_);
        pose.position += shift.by;
        pose.heading = wrapped(pose.heading + shift.turn);
        trajectories_[robot].restart(now_ + step_, pose);
        place(robot, pose.position);
    }
    record_overlaps();
}

void Simulation::record_overlaps() {
    const double diameter = 2 * def_.profile.radius_m;
    bool touching = false;
    auto add = [&](double gap) {
        if (gap < TOUCHING * diameter) touching = true;
        if (gap < 0) statistics_.overlaps.add(-gap / diameter);
    };
    for (uint32_t robot : world_.robots()) {
        for (uint32_t other : neighbours_.of(robot))
            if (other > robot && world_.holds(other))
                add((positions_[other] - positions_[robot]).norm() - diameter);
        add(def_.arena.wall_gap(positions_[robot]) - def_.profile.radius_m);
    }
    touching_steps_ = touching ? touching_steps_ + 1 : 0;
}

/// What the robots around found may no longer hold: `robot` began to move.
void Simulation::disturb_neighbours(uint32_t robot) {
    for (uint32_t other : neighbours_.of(robot))
        surroundings_[other].look_again = std::min(surroundings_[other].look_again, now_ + step_);
}

void Simulation::sample_if_due() {
    if (now_ < next_sample_) return;
    sample_into(samples_);
    samples_due_++;
    next_sample_ = end_of_step(run_at_ + samples_due_ * def_.sample_ticks * TICK_CYCLES);
}

void Simulation::sample_into(Samples &samples) const {
    samples.tick.push_back(tick());
    for (uint32_t robot = 0; robot < robots_.size(); robot++) {
        Pose pose = trajectories_[robot].pose(now_);
        samples.add_robot(pose, robots_[robot].color(now_), def_.arena.site_at(pose.position));
    }
}

Samples Simulation::take_samples() { return std::exchange(samples_, {}); }

Samples Simulation::snapshot() const {
    Samples samples;
    sample_into(samples);
    return samples;
}

Events Simulation::take_events() {
    // Robots run one after the other; people want to read what happened in order.
    std::stable_sort(events_.begin(), events_.end(), [](const Event &a, const Event &b) {
        return a.at != b.at ? a.at < b.at : a.robot < b.robot;
    });
    return std::exchange(events_, {});
}

}  // namespace kilotwin
