#include "simulation/simulation.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "base/errors.h"
#include "base/trigonometry.h"
#include "physics/placement.h"

namespace kilotwin {

namespace {

constexpr uint32_t POWER_UP_TICKS =
    16;                             // robots are switched on within a message period of one another
constexpr int64_t LEAD_TICKS = 64;  // and at least so long before RUN
// Who is near which cell is looked up so often: rarely enough to cost little, often enough that few
// cells seem to have somebody near.
constexpr Cycles LOOK_AROUND_GRID = 16 * TICK_CYCLES;

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
      now_(0),
      next_sample_(run_at_),
      reach_m_(def.kilobot_medium ? KilobotMedium::reach_m(*def.kilobot_medium) : def.range_m),
      black_box_(def.black_box.empty() ? nullptr : map_black_box(def.black_box)),
      context_{chance_,
               events_,
               emissions_,
               black_box_,
               def.kilobot_medium ? FRAME_CYCLES : 0,
               !def.kilobot_medium,
               static_cast<Cycles>(def.battery_h * 3600 * CYCLES_PER_SECOND),
               def.temperature},
      boards_(robots_, context_),
      commands_(def.commands),
      wake_(count_robots(def), 0),
      speaks_(wake_.size(), 0),
      senders_(def.kilobot_medium ? 0 : wake_.size()),
      surroundings_(def.floor ? wake_.size() : 0),
      medium_(def.range_m, def.line_of_sight, def.profile.radius_m, wake_.size()) {
    if (wake_.empty()) throw EngineError("there is no robot");
    if (def.floor) floor_.emplace(*def.floor, run_at_, step_, wake_.size());
    std::stable_sort(commands_.begin(), commands_.end(),
                     [](const auto &a, const auto &b) { return a.tick < b.tick; });
    create_robots();
    if (def.grid)
        grid_.emplace(*def.grid, chance_, POWER_UP_TICKS * TICK_CYCLES, run_at_,
                      !def.kilobot_medium, def.run_ahead, &boards_);
    if (def.kilobot_medium)
        kilobot_medium_.emplace(
            *def.kilobot_medium, chance_, robots_, *bodies_, speaks_, emissions_, counts_,
            [this](uint32_t robot, Cycles limit) {
                return !floor_ && may_run_ahead() ? undisturbed_until(robot, limit) : now_;
            },
            [this](uint32_t robot, Cycles until) { has_lived(robot, until); },
            grid_ ? &*grid_ : nullptr, boards_.empty() ? nullptr : &boards_);
    else if (!boards_.empty())
        throw EngineError("boards need the kilobot medium: the ideal one has no pulses");
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
    robots_.reserve(poses.size());
    uint32_t index = 0;
    for (const auto &group : def_.groups) {
        const auto flash = group.on_board ? FlashImage::load(group.program) : nullptr;
        Program *program = group.on_board ? nullptr : &Program::load(group.program, group.name);
        const size_t lines = program != nullptr ? cache_lines(program->state_bytes()) : 0;
        images_.emplace_back(lines * group.count);
        const auto handlers = program != nullptr ? program->own_handlers() : std::string();
        if (!handlers.empty())
            events_.push_back({0, index, 0, program->name(), EventKind::NOTE,
                               "its own interrupt handlers are never called here: " + handlers});
        for (size_t i = 0; i < group.count; i++, index++) {
            auto power_up = static_cast<Cycles>(chance_.uniform(index, Purpose::POWER_UP, 0) *
                                                static_cast<double>(POWER_UP_TICKS * TICK_CYCLES));
            Calibration calibration = calibrate(index);
            if (flash) {
                robots_.emplace_back(context_, group.name, index, calibration, power_up);
                boards_.add(index, *flash, power_up);
            } else {
                robots_.emplace_back(context_, *program, index, calibration, power_up,
                                     images_.back()[i * lines].bytes);
            }
            robots_.back().light = def_.light.at(poses[index].position);
        }
    }
    const double radius = def_.profile.radius_m;
    // A robot hides others that are within reach even where its centre is not.
    const double hides_m = !def_.kilobot_medium && def_.line_of_sight ? radius : 0;
    bodies_.emplace(def_.arena, def_.profile, chance_, step_, start_, poses,
                    std::max(reach_m_ + hides_m, floor_ ? 2 * radius + floor_->obstacle_m() : 0),
                    def_.solver);
}

Calibration Simulation::calibrate(uint32_t index) const {
    constexpr double LIMIT = 3;
    auto spread = [&](Purpose purpose, double sd) {
        return 1 + sd * std::clamp(chance_.normal(index, purpose, 0), -LIMIT, LIMIT);
    };
    const auto &p = def_.profile;
    const double tick =
        static_cast<double>(TICK_CYCLES) * spread(Purpose::CLOCK, def_.clock_spread);
    return {static_cast<Cycles>(tick + 0.5),
            static_cast<uint16_t>(index + 1),
            p.turn_left,
            p.turn_right,
            p.straight_left,
            p.straight_right,
            InfraredGains(spread(Purpose::SENSITIVITY, def_.sensitivity_spread))};
}

// From power-up to RUN robots wait on their places for what the host tells them.
void Simulation::boot() {
    Robot::serve_this_thread();
    give_commands(start_);
    for (auto &robot : robots_) robot.run(start_);
    boards_.run(start_, [](uint32_t) { return false; });
    for (uint32_t robot : boards_.robots()) wake_[robot] = NEVER;  // they run with the medium
    emissions_.clear();
    for (auto &robot : robots_) {
        robot.motor_commands.clear();
        // What a board does cannot be foreseen.
        const Cycles speaks = robot.on_board() ? 0 : robot.next_ask();
        speaks_[robot.index()] = speaks;
        if (!kilobot_medium_) senders_[robot.index()].next_ask = speaks;
    }
    now_ = start_;
    if (!grid_) return;
    while (auto module = grid_->run(now_))  // nobody listens yet
        grid_->answer(*module, grid_->module(*module).outgoing().at, Module::Answer::SENT);
}

int64_t Simulation::tick_of(Cycles at) const {
    return (static_cast<int64_t>(at) - static_cast<int64_t>(run_at_)) /
           static_cast<int64_t>(TICK_CYCLES);
}

int64_t Simulation::tick() const { return tick_of(now_); }

void Simulation::advance(int64_t ticks) {
    Robot::serve_this_thread();
    const Cycles end = end_of_step(now_ + static_cast<Cycles>(ticks) * TICK_CYCLES, step_);
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
        limit =
            std::min(limit, std::max(now_ + step_,
                                     begin_of_step(command_time(commands_[next_command_]), step_)));
    refresh_lists();
    if (grid_ && (now_ - start_) % LOOK_AROUND_GRID == 0) look_around_grid();
    if (floor_) {
        later_sensing_ = floor_->next_sensing(now_);
        next_sensing_ = floor_->senses_at(now_) ? now_ : later_sensing_;
    }
    prepare_boards();
    if (kilobot_medium_) kilobot_medium_->run(now_, now_ + step_, limit);
    for (uint32_t robot : boards_.robots()) take_commands(robot);
    choose(due_, robots_.size(), [this](uint32_t robot) { return wake_[robot] <= now_; });
    for (size_t i = 0; i < due_.size(); i++) {
        prefetch_due_after(i);
        live_on(due_[i], limit);
    }
    if (!kilobot_medium_) {
        if (grid_) run_grid();
        deliver_frames();
    }
    bodies_->step();
    now_ += step_;
    steps_++;
    if (floor_)
        for (uint32_t robot : bodies_->pushed()) disturb(robot, now_);
}

Cycles Simulation::command_time(const SimulationDef::Command &command) const {
    return run_at_ +
           static_cast<Cycles>(command.tick) * TICK_CYCLES;  // negative ticks wrap as they should
}

/// Hands out the commands before `until`.
void Simulation::give_commands(Cycles until) {
    for (; next_command_ < commands_.size() && command_time(commands_[next_command_]) < until;
         next_command_++)
        give(commands_[next_command_], std::max(command_time(commands_[next_command_]), now_));
}

void Simulation::give(const SimulationDef::Command &command, Cycles at) {
    for (auto &robot : robots_) {
        if (robot.uid() < command.uid_first || robot.uid() > command.uid_last) continue;
        const uint32_t index = robot.index();
        if (command.radius_m < INFINITY &&
            (bodies_->position(index) - command.centre).norm() > command.radius_m)
            continue;
        robot.receive(at, command.message, {});
        speaks_[index] = std::min(speaks_[index], at);  // it may be told to run
    }
}

void Simulation::send(const SimulationDef::Command &command) { give(command, now_); }

void Simulation::refresh_lists() {
    if (!bodies_->refresh_lists()) return;
    for (uint32_t robot = 0; robot < senders_.size(); robot++) {
        Cycles &found = senders_[robot].audience_at;
        if (found != NEVER && bodies_->lists().changed(robot)) found = NEVER;
    }
}

/// Brings those into the cache who are due some turns after the i-th.
void Simulation::prefetch_due_after(size_t i) const {
    constexpr size_t SOON = 3, LATER = 5, LATEST = 7;
    if (robots_.size() < FETCHED_SWARM || i + LATEST >= due_.size()) return;
    const Neighbours &lists = bodies_->lists();
    const uint32_t latest = due_[i + LATEST], later = due_[i + LATER];
    robots_[latest].prefetch();
    bodies_->prefetch(latest);
    lists.prefetch_place(latest);
    if (kilobot_medium_) kilobot_medium_->prefetch(latest);
    robots_[later].prefetch_state();
    lists.prefetch(later);
    for (uint32_t other : lists.of(due_[i + SOON])) {
        prefetch_line(&speaks_[other]);
        bodies_->prefetch_place(other);
    }
}

/// Lets a robot live through this step, and on as far as nothing can reach it.
void Simulation::live_on(uint32_t robot, Cycles limit) {
    const Cycles soonest = now_ + step_;
    if (light_changes()) robots_[robot].light = def_.light.at(bodies_->position(robot));
    if (floor_) {
        auto &around = surroundings_[robot];
        if (around.look_again <= now_ || !def_.run_ahead) look_around(robot);
        limit = std::min(limit, std::max(around.unchanged_until, later_sensing_));
    }
    Cycles until = soonest;
    if (limit > soonest && may_run_ahead())
        until = std::max(undisturbed_until(robot, limit), soonest);
    if (next_sensing_ < until)
        floor_->tell(robots_[robot], surroundings_[robot].cell, next_sensing_, until);
    run_robot(robot, until);
    has_lived(robot, until);
}

/// A robot has lived up to `until`: till then it needs not be seen to. Where it waits for the
/// medium's answer it goes on in that step.
void Simulation::has_lived(uint32_t robot, Cycles until) {
    if (!robots_[robot].motor_commands.empty()) take_commands(robot);
    const bool waits = robots_[robot].question() != Robot::Question::NONE;
    wake_[robot] = begin_of_step(waits ? robots_[robot].now() : until, step_);
}

/// Until when a robot hears nothing for certain. Who may not yet be asked for a message cannot be
/// heard, nor who cannot come into reach before.
Cycles Simulation::undisturbed_until(uint32_t robot, Cycles limit) {
    // The ideal medium lets a frame be heard when the step is over in which it begins.
    const Cycles soonest = now_ + step_, heard_after = kilobot_medium_ ? 0 : step_;
    if (grid_) return soonest;  // a cell may speak to it any time
    const double s_per_m = 1 / (2 * bodies_->fastest_m_s());
    Cycles until = std::min(limit, bodies_->lists_hold_until() + heard_after);
    if (!kilobot_medium_)
        until = std::min(until, now_ + (PlannedFrames::STEPS - 1) * step_);
    else if (kilobot_medium_->claims(robot))
        return soonest;
    if (until <= soonest) return soonest;
    Cycles matters = end_of_step(until - heard_after, step_);  // who speaks before
    const Eigen::Vector2d here = bodies_->position(robot);
    for (uint32_t other : bodies_->lists().of(robot)) {  // no branch: nobody could foresee it
        const Cycles speaks =
            kilobot_medium_ ? speaks_[other] : begin_of_step(speaks_[other], step_);
        const double range_m = kilobot_medium_ ? kilobot_medium_->range_m(other) : reach_m_;
        const double way_m = (bodies_->position(other) - here).norm() - range_m;
        const Cycles in_reach = now_ + whole_steps(way_m * s_per_m, step_);
        matters = std::min(matters, std::max(speaks, in_reach));
    }
    until = std::min(until, matters + heard_after);
    return kilobot_medium_ ? kilobot_medium_->alone_until(robot, until) : until;
}

/// What the floor tells a robot, and how long it will say the same: bounded by the fastest that
/// anybody can come nearer.
void Simulation::look_around(uint32_t robot) {
    auto &around = surroundings_[robot];
    const Eigen::Vector2d here = bodies_->position(robot);
    const bool rests = bodies_->rests(robot);
    const double radius = def_.profile.radius_m, obstacle_gap = floor_->obstacle_m();
    bool obstacle = false;
    auto look_at = [&](double gap, const Eigen::Vector2d &towards) {
        if (gap <= obstacle_gap && towards.dot(bodies_->ahead(robot)) > 0) obstacle = true;
    };
    const double near_m = 2 * radius + obstacle_gap;
    double nearest = INFINITY, nearest_mover = INFINITY;  // squares
    for (uint32_t other : bodies_->lists().of(robot)) {
        const Eigen::Vector2d offset = bodies_->position(other) - here;
        const double square = offset.squaredNorm();
        if (square <= near_m * near_m) look_at(offset.norm() - 2 * radius, offset);
        nearest = std::min(nearest, square);
        if (rests && square < nearest_mover && !bodies_->rests(other)) nearest_mover = square;
    }
    // As long as nobody who is on no list can have come near. `unmoved_s`: and nobody begins to move
    // who now rests.
    const double listed_s =
        bodies_->lists_hold_until() > now_ ? seconds(bodies_->lists_hold_until() - now_) : 0;
    auto away_s = [&](double square) {
        const double way_m = std::max(std::sqrt(square) - near_m, 0.0);
        return std::min(way_m / (2 * bodies_->fastest_m_s()), listed_s);
    };
    const double unchanged_s = away_s(nearest), unmoved_s = away_s(nearest_mover);
    double wall_gap = INFINITY;
    def_.arena.for_each_wall(here, [&](double distance, const Eigen::Vector2d &outward) {
        wall_gap = std::min(wall_gap, distance - radius);
        look_at(distance - radius, outward);
    });
    const double still_s =
        std::min(std::max(wall_gap - obstacle_gap, 0.0), def_.arena.distance_to_site_edge(here)) /
        bodies_->fastest_m_s();
    around.cell.site = def_.arena.site_at(here);
    around.cell.flags = obstacle ? WIRE_CELL_OBSTACLE : 0;
    around.unchanged_until = now_ + whole_steps(std::min(unchanged_s, still_s), step_);
    around.look_again =
        rests ? now_ + std::max(whole_steps(unmoved_s, step_), step_) : around.unchanged_until;
}

/// What the floor tells `robot` and those around it may change after `at`: it moves.
void Simulation::disturb(uint32_t robot, Cycles at) {
    auto look = [&](uint32_t who) {
        surroundings_[who].look_again = std::min(surroundings_[who].look_again, at);
    };
    look(robot);
    for (uint32_t other : bodies_->lists().of(robot)) look(other);
}

void Simulation::run_robot(uint32_t index, Cycles until) {
    auto &robot = robots_[index];
    if (kilobot_medium_) {
        kilobot_medium_->live(index, until);
    } else {
        emissions_.clear();
        if (def_.run_ahead)
            robot.run(until);
        else
            for (Cycles at = now_ + TICK_CYCLES; at <= until; at += TICK_CYCLES) robot.run(at);
        plan_frames(index);
    }
}

/// What a robot told its motors.
void Simulation::take_commands(uint32_t index) {
    for (const auto &command : robots_[index].motor_commands) {
        bodies_->command(index, {std::max(command.at, now_), command.left, command.right});
        if (floor_) disturb(index, begin_of_step(command.at, step_) + step_);
    }
    robots_[index].motor_commands.clear();
}

/// What the sensors of robots on boards read in this step, and what the floor tells them.
void Simulation::prepare_boards() {
    for (uint32_t robot : boards_.robots()) {
        robots_[robot].light = def_.light.at(bodies_->position(robot));
        if (!floor_) continue;
        if (surroundings_[robot].look_again <= now_) look_around(robot);
        if (next_sensing_ < now_ + step_)
            floor_->tell(robots_[robot], surroundings_[robot].cell, next_sensing_, now_ + step_);
    }
}

RobotBoard &Simulation::board_of(size_t robot) {
    if (robot >= robots_.size()) throw EngineError("there is no robot " + std::to_string(robot));
    if (!boards_.has(static_cast<uint32_t>(robot)))
        throw EngineError("robot " + std::to_string(robot) +
                          " does not run on a board: only robots with a hex, or cpu = \"avr\", do");
    return boards_.board(static_cast<uint32_t>(robot));
}

void Simulation::serve_debugger(size_t robot, uint16_t port) {
    board_of(robot).serve_debugger(port);
}
void Simulation::trace(size_t robot, const std::string &path) { board_of(robot).trace(path); }

/// Puts the frames that a robot sends into the steps in which they begin.
void Simulation::plan_frames(uint32_t robot) {
    Sender &sender = senders_[robot];
    sender.next_ask = robots_[robot].next_ask();
    if (sender.planned == 0)
        speaks_[robot] = emissions_.empty() ? sender.next_ask : emissions_.front().at;
    for (size_t i = 0; i < emissions_.size(); i++) {
        const Cycles next = i + 1 < emissions_.size() ? emissions_[i + 1].at : sender.next_ask;
        PlannedFrame &planned = append(frames_.at(emissions_[i].at, step_));
        planned.emission = emissions_[i];
        planned.next = next;
        sender.planned++;
    }
}

void Simulation::look_around_grid() {
    const double way_m = bodies_->fastest_m_s() * seconds(LOOK_AROUND_GRID);
    grid_->look_around(now_ + LOOK_AROUND_GRID, way_m, bodies_->positions());
}

/// Beside the ideal medium: robots within range hear each cell, from the next step on.
void Simulation::run_grid() {
    const Cycles end = now_ + step_;
    while (auto index = grid_->run(end)) {
        const CellEmission sent = grid_->module(*index).outgoing();
        const uint32_t cell = GridLayout::MODULE_CELLS * *index + sent.cell;
        const Cycles heard_at = std::max(sent.at + FRAME_CYCLES, end);
        for (uint32_t robot : grid_->robots_near(cell)) {
            const double distance =
                (bodies_->position(robot) - grid_->layout().centre(cell)).norm();
            if (distance > grid_->infrared().cell_range_m || !crc_is_right(sent.message)) continue;
            const auto mm = static_cast<int16_t>(distance * 1000 + 0.5);
            robots_[robot].receive(heard_at, sent.message, {mm, mm});
            counts_.received++;
        }
        grid_->answer(*index, sent.at, Module::Answer::SENT);
    }
}

bool Simulation::send_can(uint32_t bus, const CanFrame &frame) {
    return grid().send_can(now_, bus, frame);
}

Grid &Simulation::grid() {
    if (!grid_) throw EngineError("this run has no grid");
    return *grid_;
}

const Grid &Simulation::grid() const { return const_cast<Simulation *>(this)->grid(); }

/// Beside the ideal medium: the cell below a robot hears it, from the next step on.
void Simulation::deliver_to_grid(const Emission &emission) {
    const auto cell = grid_->layout().below(bodies_->position(emission.robot));
    if (!cell) return;
    const double distance =
        (bodies_->position(emission.robot) - grid_->layout().centre(*cell)).norm();
    const auto mm = static_cast<int16_t>(distance * 1000 + 0.5);
    grid_->counts.received++;
    grid_->receive_ir(std::max(emission.at + FRAME_CYCLES, now_ + step_), *cell, emission.message,
                      {mm, mm}, !senders_[emission.robot].said.crc_is_right());
}

/// Brings those into the cache who send some turns after the i-th, and who may hear it.
void Simulation::prefetch_heard_after(const std::vector<PlannedFrame> &frames, size_t i) const {
    constexpr size_t SOONER = 2, LATER = 6, LATEST = 8;
    if (robots_.size() < FETCHED_SWARM || i + LATEST >= frames.size()) return;
    auto sender = [&](size_t turns) { return frames[i + turns].emission.robot; };
    const uint32_t latest = sender(LATEST), later = sender(LATER);
    prefetch_line(&senders_[latest]);
    prefetch_line(&speaks_[latest]);
    bodies_->lists().prefetch_place(latest);
    bodies_->lists().prefetch(later);
    for (uint32_t other : bodies_->lists().of(sender(SOONER))) robots_[other].prefetch_receiver();
}

void Simulation::deliver_frames() {
    auto &frames = frames_.at(now_, step_);
    frame_sorter_.sort(
        frames, now_, step_, [](const PlannedFrame &frame) { return frame.emission.at; },
        [](const PlannedFrame &a, const PlannedFrame &b) {
            return a.emission.at != b.emission.at ? a.emission.at < b.emission.at
                                                  : a.emission.robot < b.emission.robot;
        });
    for (size_t i = 0; i < frames.size(); i++) {
        prefetch_heard_after(frames, i);
        const auto &[emission, next] = frames[i];
        Sender &sender = senders_[emission.robot];
        sender.planned--;
        speaks_[emission.robot] = sender.planned > 0 ? next : sender.next_ask;
        deliver(emission);
    }
    frames.clear();
}

void Simulation::deliver(const Emission &emission) {
    const uint32_t sender = emission.robot;
    counts_.sent++;
    auto &said = senders_[sender].said;
    said.say(emission.message);
    if (grid_) deliver_to_grid(emission);
    if (!said.crc_is_right()) {
        counts_.wrong_crc++;
        return;
    }
    const Cycles heard_at = std::max(emission.at + FRAME_CYCLES, now_ + step_);
    for (const auto &listener : audience_of(sender)) {
        auto gain = static_cast<int16_t>(std::min<uint16_t>(listener.distance_mm, INT16_MAX));
        robots_[listener.robot].receive(heard_at, emission.message, {gain, gain});
        counts_.received++;
    }
}

/// Who hears `robot` now. As long as it moves nobody keeps that: it would not hold.
const std::vector<Listener> &Simulation::audience_of(uint32_t robot) {
    if (def_.run_ahead && audience_holds(robot)) return medium_.kept_audience(robot);
    const bool keep = bodies_->still_since(robot) != NEVER;
    senders_[robot].audience_at = keep ? now_ : NEVER;
    auto place_of = [this](uint32_t other) { return bodies_->position(other); };
    return medium_.find_audience(robot, bodies_->lists().of(robot), place_of, keep);
}

/// Whether nobody who could matter has moved since the audience of `robot` was found.
bool Simulation::audience_holds(uint32_t robot) {
    const Cycles found = senders_[robot].audience_at;
    if (found == NEVER || bodies_->still_since(robot) > found) return false;
    for (uint32_t other : bodies_->lists().of(robot))
        if (bodies_->still_since(other) > found) return false;
    return true;
}

std::vector<FrameCounts> Simulation::frames() const {
    return kilobot_medium_ ? kilobot_medium_->by_robot() : std::vector<FrameCounts>();
}

Statistics Simulation::statistics() const {
    return {steps_, counts_, bodies_->solver_steps(), bodies_->list_rebuilds(),
            bodies_->overlaps()};
}

void Simulation::sample_if_due() {
    if (now_ < next_sample_) return;
    sample_into(samples_);
    samples_due_++;
    next_sample_ = end_of_step(run_at_ + samples_due_ * def_.sample_ticks * TICK_CYCLES, step_);
}

void Simulation::sample_into(Samples &samples) const {
    samples.tick.push_back(tick());
    for (uint32_t robot = 0; robot < robots_.size(); robot++) {
        Pose pose = bodies_->pose(robot);
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
