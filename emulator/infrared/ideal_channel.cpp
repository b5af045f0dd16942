#include "infrared/ideal_channel.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "infrared/station.h"
#include "robots/inbox.h"

namespace kilotwin {

IdealChannel::IdealChannel(const Settings &settings, const ChannelContext &context)
    : Channel(context),
      range_m_(settings.range_m),
      senders_(context.robots.size()),
      frames_of_(context.robots.size()),
      in_range_(settings.range_m, settings.line_of_sight, settings.radius_m, context.bodies.arena(),
                context.robots.size(), context.team.size()),
      frames_(context.team.size()),
      shares_(context.team.size()) {}

void IdealChannel::boot(Cycles now) {
    Channel::boot(now);
    for (uint32_t robot = 0; robot < senders_.size(); robot++)
        next_begin_[robot] = senders_[robot].next_request = context_.robots[robot].next_ask();
}

// Kept receivers are those of a list: where the list changed they are found anew.
void IdealChannel::lists_changed() {
    for (uint32_t robot = 0; robot < senders_.size(); robot++) {
        Cycles &found = senders_[robot].receivers_at;
        if (found != NEVER && context_.bodies.lists().changed(robot)) found = NEVER;
    }
}

// One with a wrong CRC is light all the same, but with this medium light disturbs nobody.
void IdealChannel::shine_from_above(const message_t &message, Cycles at, uint32_t controller) {
    counts_.above_sent++;
    if (crc_is_right(message))
        insert_by_time(from_above_, {at + FRAME_CYCLES, message, controller});
}

Cycles IdealChannel::next_from_above() const {
    return from_above_.empty() ? NEVER : from_above_.front().at;
}

void IdealChannel::run(Cycles begin, Cycles end, Cycles /*limit*/) {
    begin_step(begin, end);
    for (; next_from_above() < end; from_above_.pop_front()) {
        const FromAbove &frame = from_above_.front();
        for (uint32_t slot = 0; slot < context_.robots.size(); slot++) {
            Robot &robot = context_.robots[slot];
            if (!is_covered(slot, frame.controller) || robot.is_deaf()) continue;
            counts_.above_reached++;
            if (trail() != nullptr) [[unlikely]]
                trail()->arrived({Trail::Kind::ABOVE, frame.controller}, trail()->station(slot),
                                 frame.at - FRAME_CYCLES, frame.at, frame.message);
            robot.receive(frame.at, frame.message, {});
            order(slot, frame.at);
            counts_.above_received++;
            frames_of_[slot].received++;
        }
    }
}

// A frame is received when the step is over in which it begins, at the earliest.
Cycles IdealChannel::lookahead(uint32_t robot, Cycles useful, Cycles limit) const {
    const Cycles step = context_.step;
    if (!has_lookahead_) return end_;
    const Cycles until = std::min({limit, context_.bodies.lists_hold_until() + step,
                                   now_ + (PlannedFrames::STEPS - 1) * step});
    if (until <= end_) return end_;
    // All have one range, and a frame counts from the step on in which it begins.
    auto range_of = [this](uint32_t) { return range_m_; };
    auto begin_of = [&](uint32_t other) { return begin_of_step(next_begin_[other], step); };
    const Cycles light =
        first_light(robot, useful - step, end_of_step(until - step, step), range_of, begin_of);
    return std::min(until, light + step);
}

// Tick by tick is the oracle of run ahead: the same result in smaller pieces.
void IdealChannel::run_robot(uint32_t index, Cycles until) {
    Robot &robot = context_.robots[index];
    robot.emissions().clear();
    if (context_.run_ahead)
        robot.run(until);
    else
        for (Cycles at = now_ + TICK_CYCLES; at <= until; at += TICK_CYCLES) robot.run(at);
    plan_frames(index);
}

/// Puts the frames that a robot sends into the steps in which they begin.
void IdealChannel::plan_frames(uint32_t robot) {
    Robot &of = context_.robots[robot];
    const auto &emissions = of.emissions();
    PlannedFrames &frames = frames_[of.share()];
    Sender &sender = senders_[robot];
    sender.next_request = of.next_ask();
    if (sender.planned == 0)
        next_begin_[robot] = emissions.empty() ? sender.next_request : emissions.front().at;
    // Filled where they stand: a copy of a frame that was just written would wait for its parts.
    for (size_t i = 0; i < emissions.size(); i++) {
        const Cycles next = i + 1 < emissions.size() ? emissions[i + 1].at : sender.next_request;
        PlannedFrame &planned = frames.add(emissions[i].at, context_.step);
        planned.emission = emissions[i];
        planned.emission.robot = robot;
        planned.next = next;
        sender.planned++;
    }
}

void IdealChannel::end_step() {
    for (Stations *kind : others_)
        while (kind->run(end_, end_)) continue;
    // Other stations receive frames in order of time, and so are they noted.
    if (!others_.empty() || trail() != nullptr)
        end_step_in_order();
    else
        end_step_by_place();
    for (Share &share : shares_) counts_ += std::exchange(share.counts, {});
    for (PlannedFrames &frames : frames_) frames.forget(now_, context_.step);
}

void IdealChannel::end_step_in_order() {
    auto &all = frames_.front().at(now_, context_.step);
    for (size_t share = 1; share < frames_.size(); share++) {
        const auto &more = frames_[share].at(now_, context_.step);
        all.insert(all.end(), more.begin(), more.end());
    }
    Share &share = shares_.front();
    share.sorter.sort(
        all, now_, context_.step, [](const PlannedFrame &frame) { return frame.emission.at; },
        [](const PlannedFrame &a, const PlannedFrame &b) {
            if (a.emission.at != b.emission.at) return a.emission.at < b.emission.at;
            return a.emission.robot < b.emission.robot;
        });
    send_all(all, 0, [&](const Emission &emission, const Receiver &receiver) {
        deliver(emission, receiver, share.counts);
    });
}

// Neighbours one after the other, first as senders, then as receivers: what they need is in the
// cache then. Each receiver gets what it gets in order of time, and at the same time by sender.
void IdealChannel::end_step_by_place() {
    Team &team = context_.team;
    team.share([this](uint32_t number) {
        Share &share = shares_[number];
        share.on_way.resize(shares_.size());
        for (auto &deliveries : share.on_way) deliveries.clear();
        send_all(frames_by_sender(number), number,
                 [&](const Emission &emission, const Receiver &receiver) {
                     const uint32_t to =
                         context_.team.share_of(receiver.robot, context_.robots.size());
                     share.on_way[to].push_back({&emission, receiver});
                 });
    });
    team.share([this](uint32_t share) { deliver_to(share); });
}

/// Frames of a share's senders in this step, by sender, those of one in order of time.
std::vector<PlannedFrame> &IdealChannel::frames_by_sender(uint32_t share) {
    auto &frames = frames_[share].at(now_, context_.step);
    sort_by_robot(
        shares_[share].sorter, frames, share,
        [](const PlannedFrame &frame) { return frame.emission.robot; },
        [](const PlannedFrame &frame) { return frame.emission.at; });
    return frames;
}

/// Delivers what senders of all shares have for receivers of one.
void IdealChannel::deliver_to(uint32_t number) {
    constexpr size_t LATER = 16;
    const bool many = prefetches(context_.robots.size());
    Share &share = shares_[number];
    auto &arriving = share.on_way[number];
    for (const Share &from : shares_)
        if (&from != &share)
            arriving.insert(arriving.end(), from.on_way[number].begin(), from.on_way[number].end());
    sort_by_robot(
        share.arriving_sorter, arriving, number,
        [](const Delivery &delivery) { return delivery.receiver.robot; },
        [](const Delivery &delivery) {
            return std::pair(delivery.emission->at, delivery.emission->robot);
        });
    for (size_t i = 0; i < arriving.size(); i++) {
        if (many && i + LATER < arriving.size())
            context_.robots[arriving[i + LATER].receiver.robot].prefetch_receiver();
        deliver(*arriving[i].emission, arriving[i].receiver, share.counts);
    }
}

/// Sorts what belongs to robots of a share by robot, then by what `then_of` gives.
template <typename T, typename RobotOf, typename ThenOf>
void IdealChannel::sort_by_robot(StepSorter<T> &sorter, std::vector<T> &items, uint32_t share,
                                 RobotOf robot_of, ThenOf then_of) const {
    const size_t robots = context_.robots.size(), first = context_.team.begin_of(share, robots),
                 end = context_.team.begin_of(share + 1, robots);
    sorter.sort(items, first, std::bit_ceil(end - first), robot_of, [&](const T &a, const T &b) {
        return robot_of(a) != robot_of(b) ? robot_of(a) < robot_of(b) : then_of(a) < then_of(b);
    });
}

/// Frames of the step that begins at now_, whose senders and `share` belong together.
template <typename Deliver>
void IdealChannel::send_all(const std::vector<PlannedFrame> &frames, uint32_t share,
                            Deliver deliver) {
    for (size_t i = 0; i < frames.size(); i++) {
        prefetch_after(frames, i);
        const auto &[emission, next] = frames[i];
        Sender &sender = senders_[emission.robot];
        sender.planned--;
        next_begin_[emission.robot] = sender.planned > 0 ? next : sender.next_request;
        send(emission, share, deliver);
    }
}

// Cells receive a frame whatever its CRC, robots drop one that is wrong.
template <typename Deliver>
void IdealChannel::send(const Emission &emission, uint32_t share, Deliver deliver) {
    const uint32_t sender = emission.robot;
    ChannelCounts &counts = shares_[share].counts;
    counts.sent++;
    frames_of_[sender].sent++;
    CheckedMessage &message = senders_[sender].message;
    message.say(emission.message);
    if (context_.robots[sender].is_mute()) return;
    if (!others_.empty()) {
        Frame frame = {};
        frame.begin = emission.at;
        frame.sender = frame.listener = sender;
        frame.message = &message;
        const Eigen::Vector2d here = context_.bodies.position(sender);
        for (Stations *kind : others_) kind->shine_from_robot(frame, here);
    }
    if (!message.crc_is_right()) {
        counts.wrong_crc++;
        return;
    }
    for (const auto &receiver : receivers_of(sender, share)) deliver(emission, receiver);
}

void IdealChannel::deliver(const Emission &emission, const Receiver &receiver,
                           ChannelCounts &counts) {
    Robot &robot = context_.robots[receiver.robot];
    if (robot.is_deaf()) return;
    const Cycles at = received_at(emission.at);
    if (trail() != nullptr) [[unlikely]]
        trail()->arrived(trail()->station(emission.robot), trail()->station(receiver.robot),
                         emission.at, at, emission.message);
    auto gain = static_cast<int16_t>(std::min<uint16_t>(receiver.distance_mm, INT16_MAX));
    robot.receive(at, emission.message, {gain, gain});
    frames_of_[receiver.robot].received++;
    counts.received++;
}

// The sender's kind has found that the robot is in range.
void IdealChannel::deliver(uint32_t robot, Trail::Station from, Cycles begin,
                           const message_t &message, int16_t distance_mm) {
    if (context_.robots[robot].is_deaf()) return;
    if (trail() != nullptr) [[unlikely]]
        trail()->arrived(from, trail()->station(robot), begin, received_at(begin), message);
    context_.robots[robot].receive(received_at(begin), message, {distance_mm, distance_mm});
    frames_of_[robot].received++;
    counts_.received++;
}

/// The receivers of `robot` now, found by a share. They are not kept while it moves: they would not
/// hold.
const std::vector<Receiver> &IdealChannel::receivers_of(uint32_t robot, uint32_t share) {
    const Bodies &bodies = context_.bodies;
    if (context_.run_ahead && receivers_hold(robot)) return in_range_.kept(robot);
    const bool keep = bodies.still_since(robot) != NEVER;
    senders_[robot].receivers_at = keep ? now_ : NEVER;
    auto place_of = [&](uint32_t other) { return bodies.position(other); };
    return in_range_.find(robot, bodies.lists().of(robot), place_of, keep, share);
}

/// Whether no robot that could matter has moved since the receivers of `robot` were found.
bool IdealChannel::receivers_hold(uint32_t robot) const {
    const Bodies &bodies = context_.bodies;
    const Cycles found = senders_[robot].receivers_at;
    if (found == NEVER || bodies.still_since(robot) > found) return false;
    for (uint32_t other : bodies.lists().of(robot))
        if (bodies.still_since(other) > found) return false;
    return true;
}

/// Brings into the cache what the senders some turns after the i-th need, and their receivers.
void IdealChannel::prefetch_after(const std::vector<PlannedFrame> &frames, size_t i) const {
    constexpr size_t SOONER = 4, LATER = 8, LATEST = 12;
    const auto &robots = context_.robots;
    if (!prefetches(robots.size()) || i + LATEST >= frames.size()) return;
    auto sender = [&](size_t turns) { return frames[i + turns].emission.robot; };
    const uint32_t latest = sender(LATEST), later = sender(LATER);
    const Neighbours &lists = context_.bodies.lists();
    prefetch_line(&senders_[latest]);
    prefetch_line(&frames_of_[latest]);
    robots[latest].prefetch_life();
    prefetch_next_begin(latest);
    lists.prefetch_place(latest);
    lists.prefetch(later);
    for (uint32_t other : lists.of(sender(SOONER))) {
        robots[other].prefetch_receiver();
        prefetch_line(&frames_of_[other]);
    }
}

}  // namespace kilotwin
