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
                             MediumCounts &counts, Boards *boards)
    : settings_(settings),
      chance_(chance),
      robots_(robots),
      bodies_(bodies),
      speaks_(speaks),
      emissions_(emissions),
      counts_(counts),
      boards_(boards),
      frames_(robots.size()),
      audible_(robots.size()),
      draws_(robots.size()) {
    for (uint32_t robot = 0; robot < robots.size(); robot++) {
        double spread =
            std::clamp(chance.normal(robot, Purpose::RANGE, 0), -RANGE_LIMIT, RANGE_LIMIT);
        range_m_.push_back(
            static_cast<float>(settings.range_m * (1 + spread * settings.range_spread)));
        frames_[robot].sender = robot;
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
        if (boards_ != nullptr) {
            auto busy = [this](uint32_t robot) {
                return on_air(robot) || !audible_[robot].empty();
            };
            if (auto flash = boards_->run(next, busy)) {
                take_flash(*flash);
                continue;
            }
        }
        if (next == end) return;
        const Event event = events_.top();
        events_.pop();
        switch (event.what) {
        case What::FRAME_END: end_frame(event.robot); break;
        case What::SENSE_END: end_sensing(event.robot); break;
        case What::ASK: ask(event.robot, event.at); break;
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
    return true;
}

bool KilobotMedium::receives(uint32_t robot, Cycles at) const {
    return std::any_of(audible_[robot].begin(), audible_[robot].end(), [&](uint32_t sender) {
        return frames_[sender].begin + NOTICE_CYCLES <= at;
    });
}

void KilobotMedium::begin_frame(uint32_t sender, Cycles at) {
    Frame &frame = put_on_air(sender, at);
    frame.message = robots_[sender].outgoing();
    frame.granted = robots_[sender].question() == Robot::Question::NONE;
    if (boards_ != nullptr) boards_->first_pulse(sender, at);
    if (frame.granted) {
        if (boards_ != nullptr) boards_->other_pulses(sender, at, frame.message);
        events_.push({at + FRAME_CYCLES, What::FRAME_END, sender});
    } else {
        events_.push({at + SENSE_END_CYCLES, What::SENSE_END, sender});
    }
}

/// Light of `sender` begins: whoever is in range receives, and what was on air there is spoilt.
KilobotMedium::Frame &KilobotMedium::put_on_air(uint32_t sender, Cycles at) {
    Frame &frame = frames_[sender];
    frame.begin = at;
    frame.on_air = true;
    frame.heard.clear();
    if (boards_ != nullptr) boards_->begin_light(sender);
    const Eigen::Vector2d here = bodies_.position(sender);
    const double range = range_m_[sender];
    for (uint32_t other : bodies_.lists().of(sender)) {
        double distance = (bodies_.position(other) - here).norm();
        if (distance <= range) shine_on_robot(frame, other, distance);
    }
    // What it was about to hear, it cannot hear now.
    if (settings_.half_duplex)
        for (uint32_t earlier : audible_[sender])
            for (Heard &missed : frames_[earlier].heard)
                if (missed.robot == sender) missed.fate = Heard::Fate::DEAF;
    return frame;
}

/// A frame that begins reaches a robot: it is heard, unless something else is, or comes.
void KilobotMedium::shine_on_robot(Frame &frame, uint32_t robot, double distance_m) {
    Heard heard = {robot, static_cast<float>(distance_m * 1000), Heard::Fate::CLEAR};
    auto &audible = audible_[robot];
    if (settings_.half_duplex && on_air(robot)) heard.fate = Heard::Fate::DEAF;
    if (settings_.collisions && !audible.empty()) {
        if (heard.fate == Heard::Fate::CLEAR) heard.fate = Heard::Fate::COLLIDED;
        for (uint32_t earlier : audible)
            for (Heard &spoilt : frames_[earlier].heard)
                if (spoilt.robot == robot && spoilt.fate == Heard::Fate::CLEAR)
                    spoilt.fate = Heard::Fate::COLLIDED;
    }
    if (robots_[robot].on_board()) shine_on_board(frame, heard);
    frame.heard.push_back(heard);
    audible.push_back(frame.sender);
    robots_[robot].disturb(frame.begin, frame.begin + FRAME_CYCLES);
}

/// A board sees pulses, so chance decides now what it will make of the frame. Collisions and deafness are its own
/// affair; here they only count.
void KilobotMedium::shine_on_board(const Frame &frame, Heard &heard) {
    const uint64_t draw = draws_[heard.robot]++;
    const bool lost = is_lost(frame, heard, draw);
    if (lost && heard.fate == Heard::Fate::CLEAR) heard.fate = Heard::Fate::LOST;
    boards_->reach(frame.sender, heard.robot, measure(heard, draw), lost,
                   chance_.bits(heard.robot, Purpose::LOST_PULSE, draw));
}

/// Light of a board arrives.
void KilobotMedium::take_flash(const Boards::Flash &flash) {
    using Found = PulseReader::Found;
    const uint32_t sender = flash.robot;
    Frame &frame = frames_[sender];
    const bool over = flash.given_up || flash.found == Found::NONSENSE;
    if (flash.begins && flash.found == Found::BEGIN) {
        if (on_air(sender)) leave_air(frame);
        put_on_air(sender, flash.at);
    }
    if (!flash.given_up) boards_->pulse(sender, flash.at, flash.end, flash.begins);
    if (over && on_air(sender)) {
        counts_.attempts_failed++;
        leave_air(frame);
    }
    if (flash.found == Found::MESSAGE && on_air(sender)) {
        frame.message = flash.message;
        frame.granted = true;
        end_frame(sender);
    }
}

/// Light on the receiver while it polled: the start pulse of a frame begun meanwhile, or the
/// leader's stop pulse of one that began too shortly before its own to be noticed.
bool KilobotMedium::finds_busy(uint32_t sender) const {
    if (settings_.held_busy) return true;
    if (!settings_.carrier_sense) return false;
    const Cycles first = frames_[sender].begin + SENSE_BEGIN,
                 last = frames_[sender].begin + SENSE_END_CYCLES;
    auto polled = [&](Cycles pulse) { return pulse >= first && pulse < last; };
    return std::any_of(audible_[sender].begin(), audible_[sender].end(), [&](uint32_t other) {
        return polled(frames_[other].begin) || polled(frames_[other].begin + LEADER_STOP);
    });
}

void KilobotMedium::end_sensing(uint32_t sender) {
    bool busy = finds_busy(sender);
    Frame &frame = frames_[sender];
    robots_[sender].answer(!busy);
    if (busy) {
        counts_.attempts_failed++;
        leave_air(frame);
        events_.push({frame.begin + SENSE_END_CYCLES + 1, What::ASK, sender});
    } else {
        if (boards_ != nullptr) boards_->other_pulses(sender, frame.begin, frame.message);
        events_.push({frame.begin + FRAME_CYCLES, What::FRAME_END, sender});
    }
}

void KilobotMedium::end_frame(uint32_t sender) {
    Frame &frame = frames_[sender];
    leave_air(frame);
    counts_.sent++;
    if (crc_is_right(frame.message))
        for (const Heard &heard : frame.heard) deliver(frame, heard);
    else
        counts_.wrong_crc++;
    if (!frame.granted) events_.push({frame.begin + FRAME_CYCLES, What::ASK, sender});
}

void KilobotMedium::leave_air(Frame &frame) {
    frame.on_air = false;
    for (const Heard &heard : frame.heard) {
        auto &audible = audible_[heard.robot];
        audible.erase(std::find(audible.begin(), audible.end(), frame.sender));
    }
}

void KilobotMedium::deliver(const Frame &frame, const Heard &heard) {
    if (heard.fate == Heard::Fate::COLLIDED) {
        counts_.collided++;
        return;
    }
    if (heard.fate == Heard::Fate::DEAF) {
        counts_.deaf++;
        return;
    }
    Robot &robot = robots_[heard.robot];
    const bool on_board = robot.on_board();
    const uint64_t draw = on_board ? 0 : draws_[heard.robot]++;
    if (on_board ? heard.fate == Heard::Fate::LOST : is_lost(frame, heard, draw)) {
        counts_.lost++;
        return;
    }
    counts_.received++;
    if (!on_board) robot.receive({frame.begin + FRAME_CYCLES, frame.message, measure(heard, draw)});
}

/// Whether a frame is lost on its way, by chance.
bool KilobotMedium::is_lost(const Frame &frame, const Heard &heard, uint64_t draw) const {
    const double share = heard.distance_mm / 1000 / range_m_[frame.sender];
    const double loss =
        settings_.loss + (settings_.loss_at_range - settings_.loss) * share * share * share * share;
    return chance_.uniform(heard.robot, Purpose::FRAME_LOSS, draw) < loss;
}

/// What a robot's converter makes of a frame's light.
distance_measurement_t KilobotMedium::measure(const Heard &heard, uint64_t draw) const {
    double low_noise = 0, high_noise = 0;
    if (settings_.gain_noise_lsb > 0) {
        low_noise = settings_.gain_noise_lsb * chance_.normal(heard.robot, Purpose::LOW_GAIN, draw);
        high_noise =
            settings_.gain_noise_lsb * chance_.normal(heard.robot, Purpose::HIGH_GAIN, draw);
    }
    return robots_[heard.robot].calibration().gains.measure(heard.distance_mm, low_noise,
                                                            high_noise);
}

}  // namespace kilotwin
