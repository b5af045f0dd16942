#include "infrared/kilobot_medium.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace kilotwin {

namespace {

// A pulse needs so long to be noticed: its own length and the interrupt's entry.
constexpr Cycles NOTICE_CYCLES = 72;
// Times in a frame's leader, from its start pulse on.
constexpr Cycles SENSE_BEGIN = LEADER_REST_SLOTS * SLOT_CYCLES,
                 SENSE_END_CYCLES = SENSE_BEGIN + LEADER_POLLS * POLL_CYCLES,
                 LEADER_STOP = STOP_SLOT * SLOT_CYCLES;
constexpr double RANGE_LIMIT = 3;  // of the spread

}  // namespace

KilobotMedium::KilobotMedium(const Settings &settings, const Chance &chance, Swarm<Robot> &robots,
                             Bodies &bodies, std::vector<Cycles> &speaks,
                             std::vector<Emission> &emissions, MediumCounts &counts,
                             Undisturbed undisturbed_until, LivedAhead lived_ahead, Grid *grid,
                             Boards *boards)
    : settings_(settings),
      chance_(chance),
      robots_(robots),
      bodies_(bodies),
      speaks_(speaks),
      emissions_(emissions),
      counts_(counts),
      undisturbed_until_(std::move(undisturbed_until)),
      lived_ahead_(std::move(lived_ahead)),
      grid_(grid),
      boards_(boards),
      stations_(robots.size() + (grid != nullptr ? grid->layout().cells() : 0)),
      said_(stations_.size()),
      receivers_(grid != nullptr ? grid->layout().modules() : 0) {
    for (uint32_t robot = 0; robot < robots.size(); robot++) {
        double spread =
            std::clamp(chance.normal(robot, Purpose::RANGE, 0), -RANGE_LIMIT, RANGE_LIMIT);
        ranges_m_.push_back(
            static_cast<float>(settings.range_m * (1 + spread * settings.range_spread)));
    }
    if (boards_ != nullptr && settings.held_busy) boards_->hold_busy();
}

double KilobotMedium::reach_m(const Settings &settings) {
    return settings.range_m * (1 + RANGE_LIMIT * settings.range_spread);
}

std::vector<FrameCounts> KilobotMedium::by_robot() const {
    std::vector<FrameCounts> counts;
    for (size_t robot = 0; robot < robots_.size(); robot++)
        counts.push_back(stations_[robot].counts);
    return counts;
}

void KilobotMedium::Queue::push(const Event &event) {
    events_.push_back(event);
    for (size_t i = events_.size() - 1; i > first_ && events_[i - 1] > events_[i]; i--)
        std::swap(events_[i - 1], events_[i]);
}

void KilobotMedium::Queue::pop() {
    if (2 * ++first_ < events_.size()) return;
    events_.erase(events_.begin(), events_.begin() + static_cast<ptrdiff_t>(first_));
    first_ = 0;
}

void KilobotMedium::run(Cycles begin, Cycles end, Cycles limit) {
    end_ = end;
    limit_ = limit;
    step_ = end - begin;
    find_asks(begin, end);
    for (;;) {
        const Event event = next_event();
        const Cycles next = std::min(event.at, end);
        Cycles grid_until = next;
        if (boards_ != nullptr) {
            auto busy = [this](uint32_t robot) {
                return on_air(robot) || !stations_[robot].audible.empty();
            };
            // Boards and modules hear one another: neither may get ahead.
            Cycles turn = grid_ != nullptr ? std::min(grid_->next(), next) : next;
            if (boards_->has_modules())
                turn = std::min(turn, boards_->lived_until() + Boards::QUANTUM);
            if (auto flash = boards_->run(turn, busy)) {
                take_flash(*flash);
                continue;
            }
            grid_until = std::min(turn + 1, next);
        }
        if (grid_ != nullptr && grid_->may_do_something(grid_until))
            if (auto module = grid_->run(grid_until)) {
                begin_cell_frame(*module);
                continue;
            }
        if (grid_until < next) continue;
        if (next == end) break;
        take(event);
    }
    planned_at(begin).clear();
}

/// Who is to be asked within this step, and whose planned frames begin.
void KilobotMedium::find_asks(Cycles begin, Cycles end) {
    asks_.clear();
    next_ask_ = 0;
    choose(speakers_, robots_.size(), [&](uint32_t robot) { return speaks_[robot] < end; });
    for (uint32_t robot : speakers_)
        if (!on_air(robot) && stations_[robot].planned == 0 && !on_board(robot))
            asks_.push_back({std::max(speaks_[robot], begin), What::ASK, robot});
    const auto &planned = planned_at(begin);
    for (uint32_t i = 0; i < planned.size(); i++)
        asks_.push_back({planned[i].emission.at, What::BEGIN, i});
    ask_sorter_.sort(
        asks_, begin, step_, [](const Event &event) { return event.at; },
        [](const Event &a, const Event &b) { return b > a; });
}

/// Adds to them, or to those of later steps. Most come in order of time.
void KilobotMedium::ask_later(const Event &event) {
    if (event.at < end_ && (asks_.empty() || event > asks_.back()))
        asks_.push_back(event);
    else
        other_asks_.push(event);
}

/// Brings those near who are asked, or begin a frame, some time after the `next`, and who may hear
/// them.
void KilobotMedium::prefetch_asked(size_t next) {
    constexpr size_t SOONER = 2, SOON = 4, LATER = 6, LATEST = 8;
    if (robots_.size() < FETCHED_SWARM || next + LATEST >= asks_.size()) return;
    auto is_asked = [&](size_t turns) { return asks_[next + turns].what == What::ASK; };
    const Neighbours &lists = bodies_.lists();
    const uint32_t latest = speaker(asks_[next + LATEST]), later = speaker(asks_[next + LATER]),
                   sooner = speaker(asks_[next + SOONER]);
    lists.prefetch_place(latest);
    prefetch(latest);
    prefetch_line(&said_[latest]);
    if (is_asked(LATEST)) robots_[latest].prefetch();
    lists.prefetch(later);
    if (is_asked(LATER)) robots_[later].prefetch_state();
    for (uint32_t other : lists.of(speaker(asks_[next + SOON]))) prefetch(other);
    for (uint32_t other : lists.of(sooner))
        if (is_in_range(sooner, other)) robots_[other].prefetch_light();
}

/// Whether a robot hears another one.
bool KilobotMedium::is_in_range(uint32_t sender, uint32_t other) const {
    const double range_m = ranges_m_[sender];
    return (bodies_.position(other) - bodies_.position(sender)).squaredNorm() < range_m * range_m;
}

/// Whose event an ASK or a BEGIN is.
uint32_t KilobotMedium::speaker(const Event &event) {
    if (event.what == What::ASK) return event.station;
    return planned_at(event.at)[event.station].emission.robot;
}

/// The first one; NEVER if there is none.
KilobotMedium::Event KilobotMedium::next_event() const {
    Event first = {NEVER, What::ASK, 0};
    if (next_ask_ < asks_.size()) first = asks_[next_ask_];
    if (!other_asks_.empty() && first > other_asks_.top()) first = other_asks_.top();
    if (!sense_ends_.empty() && first > sense_ends_.front()) first = sense_ends_.front();
    if (!frame_ends_.empty() && first > frame_ends_.front()) first = frame_ends_.front();
    return first;
}

void KilobotMedium::take(const Event &event) {
    switch (event.what) {
    case What::FRAME_END: frame_ends_.pop(); return end_frame(event.station);
    case What::SENSE_END: sense_ends_.pop(); return end_sensing(event.station);
    default: break;
    }
    if (next_ask_ < asks_.size() && !(asks_[next_ask_] > event))
        prefetch_asked(++next_ask_);
    else
        other_asks_.pop();
    if (event.what == What::ASK) return ask(event.station, event.at);
    const auto &[emission, next] = planned_at(event.at)[event.station];
    stations_[emission.robot].planned--;
    speaks_[emission.robot] = next;
    begin_frame(emission.robot, emission.at, emission.message, true);
}

/// Runs a robot through the moment at which it may be asked for a message, and on if it can send
/// and then be left alone.
void KilobotMedium::ask(uint32_t robot, Cycles at) {
    Cycles until = at + 1;
    if (has_channel(robot, at)) {
        const Cycles alone = undisturbed_until_(robot, limit_);
        if (alone > end_) {
            until = alone;
            robots_[robot].grant(at, alone - SENSE_END_CYCLES - 1, alone);
        } else {
            robots_[robot].grant(at, at, std::min(limit_, at + 1 + FRAME_CYCLES));
        }
    }
    asked_at_ = at;
    go_on(robot, until);
    if (until > end_) lived_ahead_(robot, until);
    const Cycles next = speaks_[robot];
    if (next < end_ && !on_air(robot) && stations_[robot].planned == 0)
        ask_later({std::max(next, at + 1), What::ASK, robot});
}

Cycles KilobotMedium::alone_until(uint32_t robot, Cycles until) const {
    const Cycles ask = speaks_[robot];
    until = std::min(until, end_ + (PlannedFrames::STEPS - 2) * step_);
    const bool may_send =
        ask + SENSE_END_CYCLES < until && robots_[robot].question() == Robot::Question::NONE;
    return may_send ? until : std::min(until, ask);
}

void KilobotMedium::live(uint32_t robot, Cycles until) {
    asked_at_ = NEVER;
    const Cycles ask = speaks_[robot];
    if (ask >= end_ && ask < until) robots_[robot].grant(ask, until - SENSE_END_CYCLES - 1, until);
    go_on(robot, until);
}

/// Runs a robot up to `until`, answering what it asks.
void KilobotMedium::go_on(uint32_t index, Cycles until) {
    Robot &robot = robots_[index];
    for (;;) {
        emissions_.clear();
        robot.run_arbitrated(until);
        if (!emissions_.empty()) take_emissions(index);
        if (robot.question() != Robot::Question::MAY_ASK || robot.now() >= end_) break;
        robot.answer(!receives(index, robot.now()));
    }
    if (robot.question() == Robot::Question::IS_CHANNEL_FREE && !on_air(index))
        begin_frame(index, robot.now(), robot.outgoing(), false);
    if (stations_[index].planned == 0) speaks_[index] = next_ask(robot);
}

/// When a robot may be asked next, at the earliest. Whoever waits to hear that the channel is busy tries again soon.
Cycles KilobotMedium::next_ask(const Robot &robot) {
    return robot.question() != Robot::Question::NONE ? robot.now() : robot.next_ask();
}

/// What a robot sends when it is asked begins now; later frames do in their time.
void KilobotMedium::take_emissions(uint32_t robot) {
    for (size_t i = 0; i < emissions_.size(); i++) {
        const Emission &emission = emissions_[i];
        if (emission.at == asked_at_) {
            begin_frame(robot, emission.at, emission.message, true);
            continue;
        }
        if (stations_[robot].planned++ == 0) speaks_[robot] = emission.at;
        const Cycles next =
            i + 1 < emissions_.size() ? emissions_[i + 1].at : next_ask(robots_[robot]);
        auto &planned = planned_at(emission.at);
        if (emission.at < end_)
            ask_later({emission.at, What::BEGIN, static_cast<uint32_t>(planned.size())});
        planned.push_back({emission, next});
    }
}

/// Whether nothing can come between if the robot is asked at `at`: it receives nothing, and nobody
/// around may start before it is done listening.
bool KilobotMedium::has_channel(uint32_t robot, Cycles at) const {
    if (settings_.held_busy || !stations_[robot].audible.empty() || on_air(robot) ||
        robots_[robot].question() != Robot::Question::NONE || robots_[robot].next_ask() != at)
        return false;
    for (uint32_t other : bodies_.lists().of(robot))
        if (speaks_[other] <= at + SENSE_END_CYCLES) return false;
    if (grid_ != nullptr)
        for (uint32_t cell : grid_->cells_near(robot))
            if (grid_->next_event(GridLayout::module_of(cell)) <= at + SENSE_END_CYCLES)
                return false;
    return true;
}

bool KilobotMedium::receives(uint32_t robot, Cycles at) const {
    return std::any_of(stations_[robot].audible.begin(), stations_[robot].audible.end(),
                       [&](uint32_t frame) { return frames_[frame].begin + NOTICE_CYCLES <= at; });
}

void KilobotMedium::begin_frame(uint32_t sender, Cycles at, const message_t &message,
                                bool granted) {
    Frame &frame = begin_light(sender, at, message);
    frame.granted = granted;
    hold_receivers(frame, at, at + (granted ? FRAME_CYCLES : SENSE_END_CYCLES));
    if (boards_ != nullptr) boards_->first_pulse(sender, at);
    if (granted) {
        if (boards_ != nullptr) boards_->other_pulses(sender, at, message);
        frame_ends_.push({at + FRAME_CYCLES, What::FRAME_END, sender});
    } else {
        sense_ends_.push({at + SENSE_END_CYCLES, What::SENSE_END, sender});
    }
}

/// Light of a robot begins: whoever is in range receives, and what was on air there is spoilt.
KilobotMedium::Frame &KilobotMedium::begin_light(uint32_t sender, Cycles at,
                                                 const message_t &message) {
    Frame &frame = put_on_air(sender, at, message);
    const Eigen::Vector2d here = bodies_.position(sender);
    for (uint32_t other : bodies_.lists().of(sender)) {
        double distance = (bodies_.position(other) - here).norm();
        if (distance <= frame.range_m) shine_on_robot(frame, other, distance);
    }
    if (grid_ != nullptr) shine_on_cells(frame, here);
    // What it was about to hear, it cannot hear now.
    if (settings_.half_duplex)
        for (uint32_t earlier : stations_[sender].audible)
            for (Heard &missed : frames_[earlier].heard)
                if (missed.station == sender) missed.fate = Fate::DEAF;
    return frame;
}

KilobotMedium::Frame &KilobotMedium::put_on_air(uint32_t sender, Cycles at,
                                                const message_t &message) {
    if (free_frames_.empty()) {
        free_frames_.push_back(static_cast<uint32_t>(frames_.size()));
        frames_.emplace_back();
    }
    stations_[sender].frame = free_frames_.back();
    free_frames_.pop_back();
    Frame &frame = frame_of(sender);
    frame.begin = at;
    frame.range_m = is_cell(sender) ? grid_->infrared().cell_range_m : ranges_m_[sender];
    frame.sender = frame.listener = sender;
    frame.granted = false;
    frame.heard.clear();
    said_[sender].say(message);
    if (boards_ != nullptr) boards_->begin_light(sender);
    return frame;
}

/// A frame that begins reaches a robot: it is heard, unless something else is, or comes.
void KilobotMedium::shine_on_robot(Frame &frame, uint32_t robot, double distance_m) {
    Heard heard = {robot, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    auto &audible = stations_[robot].audible;
    if (settings_.half_duplex && on_air(robot)) heard.fate = Fate::DEAF;
    if (settings_.collisions && !audible.empty()) {
        if (heard.fate == Fate::CLEAR) heard.fate = Fate::COLLIDED;
        spoil(audible, robot);
    }
    if (on_board(robot)) shine_on_board(frame, heard);
    reach(frame, heard);
    robots_[robot].disturb(frame.begin, frame.begin + FRAME_CYCLES);
}

/// A board sees pulses, so chance decides now what it will make of the frame. Collisions and
/// deafness are its own affair; here they only count.
void KilobotMedium::shine_on_board(const Frame &frame, Heard &heard) {
    const uint64_t draw = stations_[heard.station].draws++;
    const bool lost = is_lost(frame, heard, draw);
    if (lost && heard.fate == Fate::CLEAR) heard.fate = Fate::LOST;
    boards_->reach(frame.sender, heard.station, measure(heard, draw), lost,
                   chance_.bits(heard.station, Purpose::LOST_PULSE, draw));
}

/// Light of a board arrives.
void KilobotMedium::take_flash(const Boards::Flash &flash) {
    using Found = PulseReader::Found;
    const uint32_t sender = flash.station;
    const bool over = flash.given_up || flash.found == Found::NONSENSE;
    if (flash.begins && flash.found == Found::BEGIN) {
        if (on_air(sender)) leave_air(frame_of(sender));
        if (is_cell(sender))
            begin_cell_light(sender, flash.at, {});
        else
            begin_light(sender, flash.at, {});
    }
    if (flash.begins && on_air(sender))
        hold_receivers(frame_of(sender), flash.at, flash.at + PulseReader::SILENCE);
    if (!flash.given_up) boards_->pulse(sender, flash.at, flash.end, flash.begins);
    if (over && on_air(sender)) {
        (is_cell(sender) ? grid_->counts.put_off : counts_.attempts_failed)++;
        leave_air(frame_of(sender));
    }
    if (flash.found == Found::MESSAGE && on_air(sender)) {
        said_[sender].say(flash.message);
        frame_of(sender).granted = true;
        if (is_cell(sender)) grid_->counts.sent++;
        end_frame(sender);
    }
}

/// What `station` was about to hear of `frames` is lost to another one.
void KilobotMedium::spoil(const Frames &frames, uint32_t station) {
    for (uint32_t frame : frames)
        for (Heard &spoilt : frames_[frame].heard)
            if (spoilt.station == station && spoilt.fate == Fate::CLEAR)
                spoilt.fate = Fate::COLLIDED;
}

/// A robot's frame that begins reaches the cells around it. A module hears it if it listens to one
/// of them, and stays with that cell.
void KilobotMedium::shine_on_cells(Frame &frame, const Eigen::Vector2d &from) {
    const double range = grid_->range_m(frame.sender, frame.begin);
    for (uint32_t cell : grid_->cells_near(frame.sender)) {
        const double distance = (grid_->layout().centre(cell) - from).norm();
        if (distance > range) continue;
        const uint32_t station = station_of(cell), module = GridLayout::module_of(cell);
        if (grid_->on_board()) {
            if (grid_->lives(module)) shine_on_board_cell(frame, cell, distance);
            continue;
        }
        auto &audible = stations_[station].audible;
        Heard heard = {station, static_cast<float>(distance * 1000), Fate::CLEAR};
        if (settings_.collisions) spoil(audible, station);
        if (!grid_->lives(module) ||
            grid_->module(module).listening_cell(frame.begin) != GridLayout::index_in_module(cell))
            heard.fate = Fate::ELSEWHERE;
        else if (settings_.half_duplex && receivers_[module].sending_until > frame.begin)
            heard.fate = Fate::DEAF;
        else if (settings_.collisions && !audible.empty())
            heard.fate = Fate::COLLIDED;
        reach(frame, heard);
    }
}

/// A module on a board sees for itself. Here it only counts, by what it does when the frame begins.
void KilobotMedium::shine_on_board_cell(Frame &frame, uint32_t cell, double distance_m) {
    const uint32_t station = station_of(cell), module = GridLayout::module_of(cell);
    Heard heard = {station, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    auto &audible = stations_[station].audible;
    if (!audible.empty()) {
        spoil(audible, station);
        heard.fate = Fate::COLLIDED;
    }
    bool sends = false;
    for (uint32_t i = 0; i < GridLayout::MODULE_CELLS; i++)
        sends |= on_air(station_of(GridLayout::MODULE_CELLS * module + i));
    if (boards_->listening_cell(module) != GridLayout::index_in_module(cell))
        heard.fate = Fate::ELSEWHERE;
    else if (sends)
        heard.fate = Fate::DEAF;
    const uint64_t n = receivers_[module].draws++;
    const bool lost = chance_.uniform(module, Purpose::CELL_LOSS, n) < grid_->infrared().loss;
    if (lost && heard.fate == Fate::CLEAR) heard.fate = Fate::LOST;
    boards_->reach(frame.sender, station, cell_gains_.measure(heard.distance_mm, 0, 0), lost,
                   chance_.bits(station, Purpose::LOST_PULSE, n));
    reach(frame, heard);
}

/// Modules that a frame reaches stay with the cell that hears it.
void KilobotMedium::hold_receivers(const Frame &frame, Cycles begin, Cycles end) {
    if (grid_ == nullptr || grid_->on_board()) return;
    for (const Heard &heard : frame.heard) {
        if (!is_cell(heard.station) || heard.fate != Fate::CLEAR) continue;
        const uint32_t module = module_of(heard.station);
        grid_->module(module).hold_receiver(begin, end);
        receivers_[module].receiving_until = std::max(receivers_[module].receiving_until, end);
    }
}

/// A module is about to send.
void KilobotMedium::begin_cell_frame(uint32_t index) {
    Module &module = grid_->module(index);
    const CellEmission wanted = module.outgoing();
    const uint32_t cell = GridLayout::MODULE_CELLS * index + wanted.cell,
                   listener = GridLayout::MODULE_CELLS * index + module.listening_cell(wanted.at);
    // After a reset it may still be on air with what it sent before.
    if (receivers_[index].receiving_until > wanted.at || on_air(station_of(cell)))
        return grid_->answer(index, wanted.at, Module::Answer::RECEIVING);
    const bool granted = nobody_interferes(listener, wanted.at);
    if (granted && grid_->robots_near(cell).empty()) {  // nobody to hear it, nor to be heard
        receivers_[index].sending_until = wanted.at + FRAME_CYCLES;
        return grid_->answer(index, wanted.at, Module::Answer::SENT);
    }
    Frame &frame = begin_cell_light(station_of(cell), wanted.at, wanted.message);
    frame.listener = station_of(listener);
    receivers_[index].sending_until = wanted.at + SENSE_END_CYCLES;
    if (boards_ != nullptr) boards_->first_pulse(frame.sender, wanted.at);
    if (granted)
        cell_has_channel(frame);
    else
        sense_ends_.push({wanted.at + SENSE_END_CYCLES, What::SENSE_END, frame.sender});
}

/// Light of a cell begins: robots in range receive.
KilobotMedium::Frame &KilobotMedium::begin_cell_light(uint32_t station, Cycles at,
                                                      const message_t &message) {
    Frame &frame = put_on_air(station, at, message);
    const uint32_t cell = cell_of(station);
    for (uint32_t robot : grid_->robots_near(cell)) {
        double distance = (bodies_.position(robot) - grid_->layout().centre(cell)).norm();
        if (distance <= frame.range_m) shine_on_robot(frame, robot, distance);
    }
    return frame;
}

/// Whether a module that listens at `cell` from `at` on can only find the channel free.
bool KilobotMedium::nobody_interferes(uint32_t cell, Cycles at) const {
    if (settings_.held_busy) return false;
    if (!settings_.carrier_sense) return true;
    if (!stations_[station_of(cell)].audible.empty()) return false;
    const auto &near = grid_->robots_near(cell);
    return std::none_of(near.begin(), near.end(),
                        [&](uint32_t robot) { return speaks_[robot] <= at + SENSE_END_CYCLES; });
}

void KilobotMedium::cell_has_channel(Frame &frame) {
    const uint32_t module = module_of(frame.sender);
    receivers_[module].sending_until = frame.begin + FRAME_CYCLES;
    if (boards_ != nullptr)
        boards_->other_pulses(frame.sender, frame.begin, said_[frame.sender].message());
    grid_->answer(module, frame.begin, Module::Answer::SENT);
    frame_ends_.push({frame.begin + FRAME_CYCLES, What::FRAME_END, frame.sender});
}

/// Light on the receiver while it polled: the start pulse of a frame begun meanwhile, or the
/// leader's stop pulse of one that began too shortly before its own to be noticed.
bool KilobotMedium::finds_busy(const Frame &frame) const {
    if (settings_.held_busy) return true;
    if (!settings_.carrier_sense) return false;
    const Cycles first = frame.begin + SENSE_BEGIN, last = frame.begin + SENSE_END_CYCLES;
    auto polled = [&](Cycles pulse) { return pulse >= first && pulse < last; };
    const auto &audible = stations_[frame.listener].audible;
    return std::any_of(audible.begin(), audible.end(), [&](uint32_t other) {
        return polled(frames_[other].begin) || polled(frames_[other].begin + LEADER_STOP);
    });
}

void KilobotMedium::end_sensing(uint32_t sender) {
    Frame &frame = frame_of(sender);
    const bool busy = finds_busy(frame);
    if (is_cell(sender)) {
        if (!busy) return cell_has_channel(frame);
        leave_air(frame);
        return grid_->answer(module_of(sender), frame.begin, Module::Answer::BUSY);
    }
    robots_[sender].answer(!busy);
    if (busy) {
        counts_.attempts_failed++;
        leave_air(frame);
        ask_later({frame.begin + SENSE_END_CYCLES + 1, What::ASK, sender});
    } else {
        if (boards_ != nullptr) boards_->other_pulses(sender, frame.begin, said_[sender].message());
        hold_receivers(frame, frame.begin + SENSE_END_CYCLES, frame.begin + FRAME_CYCLES);
        frame_ends_.push({frame.begin + FRAME_CYCLES, What::FRAME_END, sender});
    }
}

void KilobotMedium::end_frame(uint32_t sender) {
    Frame &frame = frame_of(sender);
    leave_air(frame);
    const bool right = said_[sender].crc_is_right();
    if (!is_cell(sender)) {
        counts_.sent++;
        stations_[sender].counts.sent++;
        counts_.wrong_crc += !right;
    }
    for (const Heard &heard : frame.heard)
        if (is_cell(heard.station))
            deliver_to_cell(frame, heard);
        else if (right)
            deliver(frame, heard);
    if (is_cell(sender) || on_board(sender)) return;
    // With a short period of its own it may be asked again within this step.
    const Cycles over = frame.begin + FRAME_CYCLES;
    if (!frame.granted)
        ask_later({over, What::ASK, sender});
    else if (speaks_[sender] < end_ && stations_[sender].planned == 0)
        ask_later({std::max(over, speaks_[sender]), What::ASK, sender});
}

/// What it was can still be read until the next one begins.
void KilobotMedium::leave_air(const Frame &frame) {
    const uint32_t index = std::exchange(stations_[frame.sender].frame, NONE);
    free_frames_.push_back(index);
    for (const Heard &heard : frame.heard) {
        auto &audible = stations_[heard.station].audible;
        *std::find(audible.begin(), audible.end(), index) = audible.back();
        audible.pop_back();
    }
}

void KilobotMedium::deliver_to_cell(const Frame &frame, const Heard &heard) {
    const uint32_t index = module_of(heard.station);
    auto &counts = grid_->counts;
    switch (heard.fate) {
    case Fate::ELSEWHERE: counts.elsewhere++; return;
    case Fate::DEAF: counts.deaf++; return;
    case Fate::COLLIDED: counts.collided++; return;
    case Fate::LOST: counts.lost++; return;
    case Fate::CLEAR: break;
    }
    if (grid_->on_board()) {
        counts.received++;
        return;
    }
    const uint64_t n = receivers_[index].draws++;
    if (chance_.uniform(index, Purpose::CELL_LOSS, n) < grid_->infrared().loss) {
        counts.lost++;
        return;
    }
    counts.received++;
    grid_->receive_ir(frame.begin + FRAME_CYCLES, cell_of(heard.station),
                      said_[frame.sender].message(), cell_gains_.measure(heard.distance_mm, 0, 0),
                      !said_[frame.sender].crc_is_right());
}

void KilobotMedium::deliver(const Frame &frame, const Heard &heard) {
    if (heard.fate == Fate::COLLIDED) {
        counts_.collided++;
        return;
    }
    if (heard.fate == Fate::DEAF) {
        counts_.deaf++;
        return;
    }
    const uint32_t index = heard.station;
    const bool sees_pulses = on_board(index);
    const uint64_t draw = sees_pulses ? 0 : stations_[index].draws++;
    if (sees_pulses ? heard.fate == Fate::LOST : is_lost(frame, heard, draw)) {
        counts_.lost++;
        return;
    }
    counts_.received++;
    stations_[index].counts.received++;
    if (sees_pulses) return;
    const Cycles end = frame.begin + FRAME_CYCLES;
    robots_[index].receive(end, said_[frame.sender].message(), measure(heard, draw));
    // It may be told to run, and then to send, before the others are past that.
    if (is_cell(frame.sender) && robots_[index].next_ask() == NEVER && end < end_)
        ask_later({end, What::ASK, index});
}

/// Whether a frame is lost on its way, by chance.
bool KilobotMedium::is_lost(const Frame &frame, const Heard &heard, uint64_t draw) const {
    const double share = heard.distance_mm / 1000 / frame.range_m;
    const double loss =
        settings_.loss + (settings_.loss_at_range - settings_.loss) * share * share * share * share;
    return chance_.uniform(heard.station, Purpose::FRAME_LOSS, draw) < loss;
}

/// What a robot's converter makes of a frame's light.
distance_measurement_t KilobotMedium::measure(const Heard &heard, uint64_t draw) const {
    std::array<double, 2> noise = {0, 0};
    if (settings_.gain_noise_lsb > 0)
        noise = chance_.normals(heard.station, {Purpose::LOW_GAIN, Purpose::HIGH_GAIN}, draw);
    return robots_[heard.station].calibration().gains.measure(heard.distance_mm,
                                                              settings_.gain_noise_lsb * noise[0],
                                                              settings_.gain_noise_lsb * noise[1]);
}

}  // namespace kilotwin
