#include "engine/kilobot_medium.h"

#include <algorithm>
#include <cmath>

#include "engine/message_crc.h"

namespace kilotwin {

namespace {

constexpr Cycles SLOT = 269;
// A pulse needs so long to be noticed: its own length and the interrupt's entry.
constexpr Cycles NOTICE_CYCLES = 72;
// The leader: start pulse, two slots of rest, 235 polls of 8 cycles, stop pulse in the tenth slot.
constexpr Cycles SENSE_BEGIN = 2 * SLOT, SENSE_END_CYCLES = SENSE_BEGIN + 235 * 8,
                 LEADER_STOP = 9 * SLOT;
constexpr double RANGE_LIMIT = 3;  // of the spread

}  // namespace

KilobotMedium::KilobotMedium(const Settings &settings, const Chance &chance,
                             std::vector<Robot> &robots, Bodies &bodies,
                             std::vector<Cycles> &speaks, std::vector<Emission> &emissions,
                             MediumCounts &counts, Grid *grid, Boards *boards)
    : settings_(settings),
      chance_(chance),
      robots_(robots),
      bodies_(bodies),
      speaks_(speaks),
      emissions_(emissions),
      counts_(counts),
      by_robot_(robots.size()),
      grid_(grid),
      boards_(boards),
      frames_(robots.size() + (grid != nullptr ? grid->layout().cells() : 0)),
      audible_(frames_.size()),
      draws_(robots.size()),
      receivers_(grid != nullptr ? grid->layout().modules() : 0) {
    for (uint32_t station = 0; station < frames_.size(); station++)
        frames_[station].sender = frames_[station].listener = station;
    for (uint32_t robot = 0; robot < robots.size(); robot++) {
        double spread =
            std::clamp(chance.normal(robot, Purpose::RANGE, 0), -RANGE_LIMIT, RANGE_LIMIT);
        range_m_.push_back(
            static_cast<float>(settings.range_m * (1 + spread * settings.range_spread)));
    }
    if (boards_ != nullptr && settings.held_busy) boards_->hold_busy();
}

double KilobotMedium::reach_m(const Settings &settings) {
    return settings.range_m * (1 + RANGE_LIMIT * settings.range_spread);
}

void KilobotMedium::run(Cycles begin, Cycles end, Cycles limit) {
    end_ = end;
    limit_ = limit;
    for (uint32_t robot = 0; robot < robots_.size(); robot++)
        if (speaks_[robot] < end && !on_air(robot) && !robots_[robot].on_board())
            events_.push({std::max(speaks_[robot], begin), What::ASK, robot});
    for (;;) {
        const Cycles next = events_.empty() ? end : std::min(events_.top().at, end);
        Cycles grid_until = next;
        if (boards_ != nullptr) {
            auto busy = [this](uint32_t robot) {
                return on_air(robot) || !audible_[robot].empty();
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
        if (grid_ != nullptr)
            if (auto module = grid_->run(grid_until)) {
                begin_cell_frame(*module);
                continue;
            }
        if (grid_until < next) continue;
        if (next == end) return;
        const Event event = events_.top();
        events_.pop();
        switch (event.what) {
        case What::FRAME_END: end_frame(event.station); break;
        case What::SENSE_END: end_sensing(event.station); break;
        case What::ASK: ask(event.station, event.at); break;
        }
    }
}

/// Runs a robot through the moment at which it may be asked for a message.
void KilobotMedium::ask(uint32_t robot, Cycles at) {
    if (has_channel(robot, at)) robots_[robot].grant(at, std::min(limit_, at + 1 + FRAME_CYCLES));
    go_on(robot, at + 1);
    const Cycles next = robots_[robot].next_ask();
    if (next < end_ && !on_air(robot)) events_.push({std::max(next, at + 1), What::ASK, robot});
}

void KilobotMedium::live(uint32_t robot, Cycles until) {
    go_on(robot, until);
    speaks_[robot] = robots_[robot].next_ask();
}

/// Runs a robot up to `until`, answering what it asks.
void KilobotMedium::go_on(uint32_t index, Cycles until) {
    Robot &robot = robots_[index];
    do {
        emissions_.clear();
        robot.run_arbitrated(until);
        if (!emissions_.empty()) begin_frame(index, emissions_.back().at);
        if (robot.question() == Robot::Question::MAY_ASK)
            robot.answer(!receives(index, robot.now()));
        else
            break;
    } while (true);
    if (robot.question() == Robot::Question::IS_CHANNEL_FREE && !on_air(index))
        begin_frame(index, robot.now());
    speaks_[index] = robot.next_ask();
}

/// Whether nothing can come between if the robot is asked at `at`: it receives nothing, and nobody
/// around may start before it is done listening.
bool KilobotMedium::has_channel(uint32_t robot, Cycles at) const {
    if (settings_.held_busy || !audible_[robot].empty() || on_air(robot) ||
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
    return std::any_of(audible_[robot].begin(), audible_[robot].end(), [&](uint32_t sender) {
        return frames_[sender].begin + NOTICE_CYCLES <= at;
    });
}

void KilobotMedium::begin_frame(uint32_t sender, Cycles at) {
    Frame &frame = begin_light(sender, at, robots_[sender].outgoing());
    frame.granted = robots_[sender].question() == Robot::Question::NONE;
    hold_receivers(frame, at, at + (frame.granted ? FRAME_CYCLES : SENSE_END_CYCLES));
    if (boards_ != nullptr) boards_->first_pulse(sender, at);
    if (frame.granted) {
        if (boards_ != nullptr) boards_->other_pulses(sender, at, frame.message);
        events_.push({at + FRAME_CYCLES, What::FRAME_END, sender});
    } else {
        events_.push({at + SENSE_END_CYCLES, What::SENSE_END, sender});
    }
}

/// Light of a robot begins: whoever is in range receives, and what was on air there is spoilt.
KilobotMedium::Frame &KilobotMedium::begin_light(uint32_t sender, Cycles at,
                                                 const message_t &message) {
    Frame &frame = put_on_air(sender, at, message);
    const Eigen::Vector2d here = bodies_.position(sender);
    const double range = range_m_[sender];
    for (uint32_t other : bodies_.lists().of(sender)) {
        double distance = (bodies_.position(other) - here).norm();
        if (distance <= range) shine_on_robot(frame, other, distance);
    }
    if (grid_ != nullptr) shine_on_cells(frame, here);
    // What it was about to hear, it cannot hear now.
    if (settings_.half_duplex)
        for (uint32_t earlier : audible_[sender])
            for (Heard &missed : frames_[earlier].heard)
                if (missed.station == sender) missed.fate = Fate::DEAF;
    return frame;
}

KilobotMedium::Frame &KilobotMedium::put_on_air(uint32_t sender, Cycles at,
                                                const message_t &message) {
    Frame &frame = frames_[sender];
    frame.begin = at;
    frame.on_air = true;
    frame.message = message;
    frame.heard.clear();
    if (boards_ != nullptr) boards_->begin_light(sender);
    return frame;
}

/// A frame that begins reaches a robot: it is heard, unless something else is, or comes.
void KilobotMedium::shine_on_robot(Frame &frame, uint32_t robot, double distance_m) {
    Heard heard = {robot, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    auto &audible = audible_[robot];
    if (settings_.half_duplex && on_air(robot)) heard.fate = Fate::DEAF;
    if (settings_.collisions && !audible.empty()) {
        if (heard.fate == Fate::CLEAR) heard.fate = Fate::COLLIDED;
        spoil(audible, robot);
    }
    if (robots_[robot].on_board()) shine_on_board(frame, heard);
    frame.heard.push_back(heard);
    audible.push_back(frame.sender);
    robots_[robot].disturb(frame.begin, frame.begin + FRAME_CYCLES);
}

/// A board sees pulses, so chance decides now what it will make of the frame. Collisions and
/// deafness are its own affair; here they only count.
void KilobotMedium::shine_on_board(const Frame &frame, Heard &heard) {
    const uint64_t draw = draws_[heard.station]++;
    const bool lost = is_lost(frame, heard, draw);
    if (lost && heard.fate == Fate::CLEAR) heard.fate = Fate::LOST;
    boards_->reach(frame.sender, heard.station, measure(heard, draw), lost,
                   chance_.bits(heard.station, Purpose::LOST_PULSE, draw));
}

/// Light of a board arrives.
void KilobotMedium::take_flash(const Boards::Flash &flash) {
    using Found = PulseReader::Found;
    const uint32_t sender = flash.station;
    Frame &frame = frames_[sender];
    const bool over = flash.given_up || flash.found == Found::NONSENSE;
    if (flash.begins && flash.found == Found::BEGIN) {
        if (on_air(sender)) leave_air(frame);
        if (is_cell(sender))
            begin_cell_light(sender, flash.at, {});
        else
            begin_light(sender, flash.at, {});
    }
    if (flash.begins && on_air(sender))
        hold_receivers(frame, flash.at, flash.at + PulseReader::SILENCE);
    if (!flash.given_up) boards_->pulse(sender, flash.at, flash.end, flash.begins);
    if (over && on_air(sender)) {
        (is_cell(sender) ? grid_->counts.put_off : counts_.attempts_failed)++;
        leave_air(frame);
    }
    if (flash.found == Found::MESSAGE && on_air(sender)) {
        frame.message = flash.message;
        frame.granted = true;
        if (is_cell(sender)) grid_->counts.sent++;
        end_frame(sender);
    }
}

/// What `station` was about to hear of `senders` is lost to another frame.
void KilobotMedium::spoil(const std::vector<uint32_t> &senders, uint32_t station) {
    for (uint32_t sender : senders)
        for (Heard &spoilt : frames_[sender].heard)
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
        auto &audible = audible_[station];
        Heard heard = {station, static_cast<float>(distance * 1000), Fate::CLEAR};
        if (settings_.collisions) spoil(audible, station);
        if (!grid_->lives(module) ||
            grid_->module(module).listening_cell(frame.begin) != GridLayout::index_in_module(cell))
            heard.fate = Fate::ELSEWHERE;
        else if (settings_.half_duplex && receivers_[module].sending_until > frame.begin)
            heard.fate = Fate::DEAF;
        else if (settings_.collisions && !audible.empty())
            heard.fate = Fate::COLLIDED;
        frame.heard.push_back(heard);
        audible.push_back(frame.sender);
    }
}

/// A module on a board sees for itself. Here it only counts, by what it does when the frame begins.
void KilobotMedium::shine_on_board_cell(Frame &frame, uint32_t cell, double distance_m) {
    const uint32_t station = station_of(cell), module = GridLayout::module_of(cell);
    Heard heard = {station, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    auto &audible = audible_[station];
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
    frame.heard.push_back(heard);
    audible.push_back(frame.sender);
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
        events_.push({wanted.at + SENSE_END_CYCLES, What::SENSE_END, frame.sender});
}

/// Light of a cell begins: robots in range receive.
KilobotMedium::Frame &KilobotMedium::begin_cell_light(uint32_t station, Cycles at,
                                                      const message_t &message) {
    Frame &frame = put_on_air(station, at, message);
    const uint32_t cell = cell_of(station);
    for (uint32_t robot : grid_->robots_near(cell)) {
        double distance = (bodies_.position(robot) - grid_->layout().centre(cell)).norm();
        if (distance <= grid_->infrared().cell_range_m) shine_on_robot(frame, robot, distance);
    }
    return frame;
}

/// Whether a module that listens at `cell` from `at` on can only find the channel free.
bool KilobotMedium::nobody_interferes(uint32_t cell, Cycles at) const {
    if (settings_.held_busy) return false;
    if (!settings_.carrier_sense) return true;
    if (!audible_[station_of(cell)].empty()) return false;
    const auto &near = grid_->robots_near(cell);
    return std::none_of(near.begin(), near.end(),
                        [&](uint32_t robot) { return speaks_[robot] <= at + SENSE_END_CYCLES; });
}

void KilobotMedium::cell_has_channel(Frame &frame) {
    const uint32_t module = module_of(frame.sender);
    receivers_[module].sending_until = frame.begin + FRAME_CYCLES;
    if (boards_ != nullptr) boards_->other_pulses(frame.sender, frame.begin, frame.message);
    grid_->answer(module, frame.begin, Module::Answer::SENT);
    events_.push({frame.begin + FRAME_CYCLES, What::FRAME_END, frame.sender});
}

/// Light on the receiver while it polled: the start pulse of a frame begun meanwhile, or the
/// leader's stop pulse of one that began too shortly before its own to be noticed.
bool KilobotMedium::finds_busy(const Frame &frame) const {
    if (settings_.held_busy) return true;
    if (!settings_.carrier_sense) return false;
    const Cycles first = frame.begin + SENSE_BEGIN, last = frame.begin + SENSE_END_CYCLES;
    auto polled = [&](Cycles pulse) { return pulse >= first && pulse < last; };
    const auto &audible = audible_[frame.listener];
    return std::any_of(audible.begin(), audible.end(), [&](uint32_t other) {
        return polled(frames_[other].begin) || polled(frames_[other].begin + LEADER_STOP);
    });
}

void KilobotMedium::end_sensing(uint32_t sender) {
    Frame &frame = frames_[sender];
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
        events_.push({frame.begin + SENSE_END_CYCLES + 1, What::ASK, sender});
    } else {
        if (boards_ != nullptr) boards_->other_pulses(sender, frame.begin, frame.message);
        hold_receivers(frame, frame.begin + SENSE_END_CYCLES, frame.begin + FRAME_CYCLES);
        events_.push({frame.begin + FRAME_CYCLES, What::FRAME_END, sender});
    }
}

void KilobotMedium::end_frame(uint32_t sender) {
    Frame &frame = frames_[sender];
    leave_air(frame);
    const bool right = crc_is_right(frame.message);
    if (!is_cell(sender)) {
        counts_.sent++;
        by_robot_[sender].sent++;
        counts_.wrong_crc += !right;
    }
    for (const Heard &heard : frame.heard)
        if (is_cell(heard.station))
            deliver_to_cell(frame, heard);
        else if (right)
            deliver(frame, heard);
    if (!is_cell(sender) && !frame.granted)
        events_.push({frame.begin + FRAME_CYCLES, What::ASK, sender});
}

void KilobotMedium::leave_air(Frame &frame) {
    frame.on_air = false;
    for (const Heard &heard : frame.heard) {
        auto &audible = audible_[heard.station];
        audible.erase(std::find(audible.begin(), audible.end(), frame.sender));
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
    grid_->receive_ir(frame.begin + FRAME_CYCLES, cell_of(heard.station), frame.message,
                      cell_gains_.measure(heard.distance_mm, 0, 0), !crc_is_right(frame.message));
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
    const bool on_board = robots_[index].on_board();
    const uint64_t draw = on_board ? 0 : draws_[index]++;
    if (on_board ? heard.fate == Fate::LOST : is_lost(frame, heard, draw)) {
        counts_.lost++;
        return;
    }
    counts_.received++;
    by_robot_[index].received++;
    if (on_board) return;
    const Cycles end = frame.begin + FRAME_CYCLES;
    robots_[index].receive({end, frame.message, measure(heard, draw)});
    // It may be told to run, and then to send, before the others are past that.
    if (is_cell(frame.sender) && robots_[index].next_ask() == NEVER && end < end_)
        events_.push({end, What::ASK, index});
}

/// Whether a frame is lost on its way, by chance.
bool KilobotMedium::is_lost(const Frame &frame, const Heard &heard, uint64_t draw) const {
    const double range =
        is_cell(frame.sender) ? grid_->infrared().cell_range_m : range_m_[frame.sender];
    const double share = heard.distance_mm / 1000 / range;
    const double loss =
        settings_.loss + (settings_.loss_at_range - settings_.loss) * share * share * share * share;
    return chance_.uniform(heard.station, Purpose::FRAME_LOSS, draw) < loss;
}

/// What a robot's converter makes of a frame's light.
distance_measurement_t KilobotMedium::measure(const Heard &heard, uint64_t draw) const {
    double low_noise = 0, high_noise = 0;
    if (settings_.gain_noise_lsb > 0) {
        low_noise =
            settings_.gain_noise_lsb * chance_.normal(heard.station, Purpose::LOW_GAIN, draw);
        high_noise =
            settings_.gain_noise_lsb * chance_.normal(heard.station, Purpose::HIGH_GAIN, draw);
    }
    return robots_[heard.station].calibration().gains.measure(heard.distance_mm, low_noise,
                                                              high_noise);
}

}  // namespace kilotwin
