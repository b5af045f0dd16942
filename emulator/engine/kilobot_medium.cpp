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
                             MediumCounts &counts)
    : settings_(settings),
      chance_(chance),
      robots_(robots),
      bodies_(bodies),
      speaks_(speaks),
      emissions_(emissions),
      counts_(counts),
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
}

double KilobotMedium::reach_m(const Settings &settings) {
    return settings.range_m * (1 + RANGE_LIMIT * settings.range_spread);
}

void KilobotMedium::run(Cycles begin, Cycles end, Cycles limit) {
    end_ = end;
    limit_ = limit;
    for (uint32_t robot = 0; robot < robots_.size(); robot++)
        if (speaks_[robot] < end && !on_air(robot))
            events_.push({std::max(speaks_[robot], begin), What::ASK, robot});
    while (!events_.empty() && events_.top().at < end) {
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
    Frame &frame = frames_[sender];
    frame.begin = at;
    frame.on_air = true;
    frame.message = robots_[sender].outgoing();
    frame.heard.clear();
    const Eigen::Vector2d here = bodies_.position(sender);
    const double range = range_m_[sender];
    for (uint32_t other : bodies_.lists().of(sender)) {
        double distance = (bodies_.position(other) - here).norm();
        if (distance > range) continue;
        Heard heard = {other, static_cast<float>(distance * 1000), Heard::Fate::CLEAR};
        if (settings_.half_duplex && on_air(other)) heard.fate = Heard::Fate::DEAF;
        if (settings_.collisions && !audible_[other].empty()) {
            if (heard.fate == Heard::Fate::CLEAR) heard.fate = Heard::Fate::COLLIDED;
            for (uint32_t earlier : audible_[other])
                for (Heard &spoilt : frames_[earlier].heard)
                    if (spoilt.robot == other && spoilt.fate == Heard::Fate::CLEAR)
                        spoilt.fate = Heard::Fate::COLLIDED;
        }
        frame.heard.push_back(heard);
        audible_[other].push_back(sender);
        robots_[other].disturb(at, at + FRAME_CYCLES);
    }
    // What it was about to hear, it cannot hear now.
    if (settings_.half_duplex)
        for (uint32_t earlier : audible_[sender])
            for (Heard &missed : frames_[earlier].heard)
                if (missed.robot == sender) missed.fate = Heard::Fate::DEAF;
    frame.granted = robots_[sender].question() == Robot::Question::NONE;
    if (frame.granted)
        events_.push({at + FRAME_CYCLES, What::FRAME_END, sender});
    else
        events_.push({at + SENSE_END_CYCLES, What::SENSE_END, sender});
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
    uint64_t n = draws_[heard.robot]++;
    double share = heard.distance_mm / 1000 / range_m_[frame.sender];
    double loss =
        settings_.loss + (settings_.loss_at_range - settings_.loss) * share * share * share * share;
    if (chance_.uniform(heard.robot, Purpose::FRAME_LOSS, n) < loss) {
        counts_.lost++;
        return;
    }
    counts_.received++;
    double low_noise = 0, high_noise = 0;
    if (settings_.gain_noise_lsb > 0) {
        low_noise = settings_.gain_noise_lsb * chance_.normal(heard.robot, Purpose::LOW_GAIN, n);
        high_noise = settings_.gain_noise_lsb * chance_.normal(heard.robot, Purpose::HIGH_GAIN, n);
    }
    robot.receive({frame.begin + FRAME_CYCLES, frame.message,
                   robot.calibration().gains.measure(heard.distance_mm, low_noise, high_noise)});
}

}  // namespace kilotwin
