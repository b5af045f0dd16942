#include "infrared/guest_robots.h"

#include <algorithm>
#include <utility>

#include "base/selection.h"
#include "infrared/kilobot_channel.h"
#include "kilolib/core/robot_query.h"

namespace kilotwin {

GuestRobots::GuestRobots(KilobotChannel &channel, const ChannelContext &context,
                         const RobotReceiver &receiver, bool runs_past_requests, RanAhead ran_ahead)
    : channel_(channel),
      context_(context),
      receiver_(receiver),
      runs_past_requests_(runs_past_requests),
      ran_ahead_(std::move(ran_ahead)),
      shares_(channel.lanes().count()),
      tentative_(context.robots, context.step) {}

double GuestRobots::range_m(uint32_t robot) const { return channel_.robot_range_m(robot); }

Cycles GuestRobots::next_begin(uint32_t robot) const { return context_.robots[robot].next_ask(); }

// Requests

// First finds them, as all robots stand, then executes them.
void GuestRobots::run_first() {
    Team &team = context_.team;
    team.share(context_.robots.size(), [this](uint32_t share, size_t begin, size_t end) {
        find_senders(shares_[share], begin, end);
    });
    team.share([this](uint32_t share) {
        const auto &first = shares_[share].first;
        for (size_t i = 0; i < first.size(); i++) {
            prefetch_first_after(shares_[share], i);
            run_first(first[i].first, first[i].second);
        }
    });
}

void GuestRobots::find_senders(Share &share, size_t begin, size_t end) {
    choose(share.senders, begin, end,
           [&](uint32_t robot) { return channel_.next_begin(robot) < channel_.end(); });
    share.first.clear();
    if (!runs_past_requests_) return;
    for (size_t i = 0; i < share.senders.size(); i++) {
        prefetch_senders_after(share, i);
        const uint32_t robot = share.senders[i];
        if (const Cycles until = run_first_until(robot); until > 0)
            share.first.emplace_back(robot, until);
    }
}

/// Until when a robot that is requested in this step may be executed before all others, since
/// nothing reaches it up to there: past the step where it is left alone, else past its request. 0
/// if it has to wait for its turn, as one does that may be run tentatively.
Cycles GuestRobots::run_first_until(uint32_t robot) const {
    const auto &station = channel_.in_flight().station(robot);
    const Cycles at = request_of(robot), end = channel_.end();
    if (station.is_tentative || station.kind != KIND || station.planned > 0 ||
        station.frame != FramesInFlight::NONE || context_.robots[robot].is_quiet() ||
        !is_channel_free(robot, at))
        return 0;
    const Cycles alone = channel_.lookahead(robot, end + 1, channel_.limit());
    return alone > end ? alone : at + 1;
}

void GuestRobots::run_first(uint32_t index, Cycles until) {
    const Cycles at = request_of(index);
    grant(context_.robots[index], at, until);
    run_on(index, until);
    if (until > channel_.end()) ran_ahead_(index, until);
}

/// Answers a robot's request beforehand: it finds the channel free, and is executed up to `until`,
/// the end of its lookahead or past the request.
void GuestRobots::grant(Robot &robot, Cycles at, Cycles until) const {
    if (until > channel_.end())
        robot.grant(at, until - CarrierSense::WINDOW_END - 1, until);
    else
        robot.grant(at, at, std::min(channel_.limit(), at + 1 + FRAME_CYCLES));
}

/// The moment of a request in this step.
Cycles GuestRobots::request_of(uint32_t robot) const {
    return std::max(channel_.next_begin(robot), channel_.now());
}

void GuestRobots::give_later_turns() {
    for (Share &share : shares_) share.events.move_later(later_);
    for (const GuestEvent &event : later_) give_turn(event.robot);
}

// They are all requests: a frame is scheduled by itself only for the step in which it begins.
void GuestRobots::change_lanes() {
    for (Share &share : shares_) share.events.move_later(later_);
    for (const GuestEvent &event : later_) lane_of(event.robot).events.put_back(event);
    later_.clear();
}

void GuestRobots::begin_events(uint32_t lane) {
    const Lanes &lanes = channel_.lanes();
    Share &share = shares_[lane];
    share.events.clear();
    if (lane != lanes.joint()) {
        hand_on_joined(lane);
        for (const uint32_t robot : share.senders)
            if (lanes.of(robot) == lane) begin_event(share, robot);
    } else {
        take_joined(share);
    }
    const auto &planned = planned_in(share);
    for (uint32_t i = 0; i < planned.size(); i++)
        share.events.add({planned[i].emission.at, planned[i].emission.robot, i});
    share.events.sort(channel_.now(), context_.step);
}

/// Splits off the planned frames of this step that are not of a share's own lane.
void GuestRobots::hand_on_joined(uint32_t lane) {
    const Lanes &lanes = channel_.lanes();
    Share &share = shares_[lane];
    share.joined.clear();
    if (lanes.joined().empty()) return;
    auto &planned = planned_in(share);
    auto is_own = [&](const PlannedFrame &frame) { return lanes.of(frame.emission.robot) == lane; };
    const auto others = std::partition(planned.begin(), planned.end(), is_own);
    share.joined.assign(others, planned.end());
    planned.erase(others, planned.end());
}

/// Requests and planned frames of the joint lane: those that are in no other.
void GuestRobots::take_joined(Share &joint) {
    const bool is_cut = channel_.lanes().are_cut();
    if (is_cut)
        for (const uint32_t robot : channel_.lanes().joined()) begin_event(joint, robot);
    auto &planned = planned_in(joint);
    for (Share &share : shares_) {
        if (!is_cut)
            for (const uint32_t robot : share.senders) begin_event(joint, robot);
        if (&share == &joint) continue;
        const auto &more = is_cut ? share.joined : planned_in(share);
        planned.insert(planned.end(), more.begin(), more.end());
    }
}

/// Adds the request of a robot, if it has one in this step and has to wait for its turn.
void GuestRobots::begin_event(Share &share, uint32_t robot) {
    const Cycles end = channel_.end();
    auto request = [&](Cycles at) {
        share.events.add({at, robot});
        give_turn(robot);
    };
    const auto &station = channel_.in_flight().station(robot);
    if (station.is_tentative) {
        const Cycles due = tentative_.due(robot);
        const bool over = due < end && !tentative_.has_message(robot);
        if (due >= end || (over && end_tentative_run(robot) >= end)) return;
        if (!over) return request(due);
    }
    if (station.frame == FramesInFlight::NONE && station.planned == 0 && station.kind == KIND &&
        channel_.next_begin(robot) < end)
        request(request_of(robot));
}

void GuestRobots::end_requests() {
    auto end_turns = [this](Share &share) {
        for (const uint32_t robot : share.turns)
            channel_.in_flight().station(robot).in_turn = false;
        share.turns.clear();
    };
    if (channel_.lanes().count() > 1) end_turns(shares_.back());
    context_.team.share([&](uint32_t share) {
        hand_over_all(shares_[share]);
        end_turns(shares_[share]);
    });
    for (Share &share : shares_) {
        share.planned.forget(channel_.now(), context_.step);
        channel_.tally() += std::exchange(share.counts, {});
    }
}

/// A robot may be executed in its turn from now on, in this step: it gets what it has received, and
/// gets at once what it receives from now on.
void GuestRobots::give_turn(uint32_t robot) {
    auto &station = channel_.in_flight().station(robot);
    if (station.in_turn) return;
    station.in_turn = true;
    lane_of(robot).turns.push_back(robot);
    if (station.arrival == FramesInFlight::NONE) return;
    Share &share = shares_[context_.robots[robot].share()];
    hand_over_up_to(std::exchange(station.arrival, FramesInFlight::NONE), share);
}

/// Hands a robot its arrivals up to the `last` one, in order of time, and leaves their places
/// empty.
void GuestRobots::hand_over_up_to(uint32_t last, Share &share) {
    if (last == FramesInFlight::NONE) return;
    Arrival &arrival = share.arrivals[last];
    hand_over_up_to(arrival.before, share);
    hand_over(arrival, share.counts);
    arrival.robot = FramesInFlight::NONE;
}

void GuestRobots::hand_over_all(Share &share) {
    constexpr size_t LATER = 8;
    const auto &arrivals = share.arrivals;
    const bool many = prefetches(context_.robots.size());
    for (size_t i = 0; i < arrivals.size(); i++) {
        if (many && i + LATER < arrivals.size() && !arrivals[i + LATER].is_handed_over()) {
            channel_.in_flight().prefetch(arrivals[i + LATER].robot);
            prefetch_receiver(arrivals[i + LATER].robot);
        }
        if (arrivals[i].is_handed_over()) continue;
        channel_.in_flight().station(arrivals[i].robot).arrival = FramesInFlight::NONE;
        hand_over(arrivals[i], share.counts);
    }
    share.arrivals.clear();
}

void GuestRobots::hand_over(const Arrival &arrival, ChannelCounts &counts) {
    const auto &[begin, range_m, draw, robot, distance_mm, message, before] = arrival;
    if (receiver_.is_lost(robot, distance_mm, range_m, draw)) {
        counts.lost++;
        return;
    }
    counts.received++;
    channel_.in_flight().station(robot).counts.received++;
    context_.robots[robot].receive(begin + FRAME_CYCLES, message,
                                   receiver_.measure(robot, distance_mm, draw));
}

GuestRobots::Share &GuestRobots::lane_of(uint32_t robot) {
    return shares_[channel_.lanes().of(robot)];
}

std::vector<PlannedFrame> &GuestRobots::planned_in(Share &share) {
    return share.planned.at(channel_.now(), context_.step);
}

/// Adds to the events of a robot's lane in this step, or to those of later steps.
void GuestRobots::schedule(const GuestEvent &event) {
    lane_of(event.robot).events.schedule(event, channel_.end());
}

Cycles GuestRobots::next_event(uint32_t lane) const {
    const GuestEvent *first = shares_[lane].events.first();
    return first != nullptr ? first->at : NEVER;
}

void GuestRobots::take_event(uint32_t lane) {
    Share &share = shares_[lane];
    const GuestEvent event = share.turn = share.events.take();
    prefetch_events(share);
    if (event.is_request()) return take_request(event.robot, event.at);
    const auto &[emission, next] = planned_in(share)[event.frame];
    channel_.in_flight().station(emission.robot).planned--;
    channel_.next_begin(emission.robot) = next;
    channel_.begin_frame(emission.robot, emission.at, emission.message, true);
}

/// Executes a robot through the moment of its request, and on if it can send and then be left
/// alone.
void GuestRobots::take_request(uint32_t index, Cycles at) {
    give_turn(index);
    Robot &robot = context_.robots[index];
    if (channel_.in_flight().station(index).is_tentative) {
        // Otherwise it is the request of a run that was brought back.
        if (!tentative_.has_message(index) || tentative_.due(index) != at) return;
        end_tentative_run(index);
        return channel_.begin_frame(index, at, robot.outgoing(), false);
    }
    if (robot.is_quiet() && may_run_tentatively(index) && run_tentatively(index)) return;
    Cycles until = at + 1;
    if (is_channel_free(index, at)) {
        // Each moment beyond this step is useful: the robot is not due again in it.
        const Cycles end = channel_.end();
        const Cycles alone =
            runs_past_requests_ ? channel_.lookahead(index, end + 1, channel_.limit()) : 0;
        if (alone > end) until = alone;
        grant(robot, at, until);
    }
    run_on(index, until, at);
    if (until > channel_.end()) ran_ahead_(index, until);
    const auto &station = channel_.in_flight().station(index);
    const Cycles next = channel_.next_begin(index);
    if (next < channel_.end() && station.frame == FramesInFlight::NONE && station.planned == 0)
        schedule({std::max(next, at + 1), index});
}

/// Whether nothing but light can make a tentative run wrong, and none falls on it.
bool GuestRobots::may_run_tentatively(uint32_t index) const {
    return runs_past_requests_ && channel_.has_guests_only() &&
           !channel_.carrier_sense().may_be_busy(index) &&
           channel_.in_flight().station(index).planned == 0 &&
           context_.robots[index].question() == Robot::Question::NONE;
}

/// Executes a robot as if no light reached it, for some steps or up to its next message. False if
/// it has to be executed in the order of time.
bool GuestRobots::run_tentatively(uint32_t index) {
    if (!tentative_.begin(index, channel_.now(), channel_.limit())) return false;
    channel_.in_flight().station(index).is_tentative = true;
    channel_.next_begin(index) = 0;  // it may be brought back, and then speak
    const Cycles due = tentative_.due(index);
    if (tentative_.has_message(index) && due < channel_.end()) schedule({due, index});
    ran_ahead_(index, due);
    return true;
}

void GuestRobots::settle(uint32_t robot) {
    if (channel_.in_flight().station(robot).is_tentative) end_tentative_run(robot);
}

/// It was right. Returns when the robot may next begin a frame.
Cycles GuestRobots::end_tentative_run(uint32_t index) {
    channel_.in_flight().station(index).is_tentative = false;
    tentative_.end(index);
    const Robot &robot = context_.robots[index];
    return channel_.next_begin(index) = std::min(next_request(robot), robot.next_message());
}

/// Light of `frame` begins to fall on a robot that was run past that: executes it again, up to
/// there.
void GuestRobots::bring_back(uint32_t index, const Frame &frame) {
    channel_.in_flight().station(index).is_tentative = false;
    tentative_.bring_back(index, frame.begin);
    Robot &robot = context_.robots[index];
    Cycles until = frame.begin;
    // Asked at the same time it would have had its turn before the frame's sender.
    const GuestEvent &turn = lane_of(index).turn;
    const bool was_asked = turn.is_request() && turn.at == frame.begin &&
                           turn.robot == frame.sender && index < frame.sender;
    if (was_asked && next_request(robot) == until) tentative_.go_on(index, ++until);
    context_.bodies.take_back_commands(index, until);
    ran_ahead_(index, until);
    const Cycles next = channel_.next_begin(index) = next_request(robot);
    if (next < channel_.end()) schedule({next, index});
}

/// Whether carrier sense is known to find the channel free if the robot's request comes at `at`: it
/// receives nothing, and no station around may begin before its window is over.
bool GuestRobots::is_channel_free(uint32_t index, Cycles at) const {
    const Robot &robot = context_.robots[index];
    if (channel_.carrier_sense().may_be_busy(index) || robot.question() != Robot::Question::NONE ||
        robot.next_ask() != at)
        return false;
    for (uint32_t other : context_.bodies.lists().of(index))
        if (channel_.next_begin(other) <= at + CarrierSense::WINDOW_END &&
            may_be_in_range(other, index))
            return false;
    return !channel_.others_begin_near(index, at + CarrierSense::WINDOW_END);
}

Cycles GuestRobots::alone_until(uint32_t robot, Cycles until) const {
    const Cycles request = channel_.next_begin(robot);
    until = std::min(until, channel_.end() + (PlannedFrames::STEPS - 2) * context_.step);
    const bool may_send = request + CarrierSense::WINDOW_END < until &&
                          context_.robots[robot].question() == Robot::Question::NONE;
    return may_send ? until : std::min(until, request);
}

void GuestRobots::run_robot(uint32_t robot, Cycles until) {
    const Cycles request = channel_.next_begin(robot);
    if (request >= channel_.end() && request < until)
        context_.robots[robot].grant(request, until - CarrierSense::WINDOW_END - 1, until);
    run_on(robot, until);
}

/// Executes a robot up to `until`, answering its questions.
void GuestRobots::run_on(uint32_t index, Cycles until, Cycles requested_at) {
    Robot &robot = context_.robots[index];
    for (;;) {
        robot.emissions().clear();
        robot.run_arbitrated(until);
        if (!robot.emissions().empty()) plan_frames(index, requested_at);
        if (robot.question() != Robot::Question::MAY_ASK || robot.now() >= channel_.end()) break;
        robot.answer(!channel_.carrier_sense().is_receiving(index, robot.now()));
    }
    const auto &station = channel_.in_flight().station(index);
    if (robot.question() == Robot::Question::IS_CHANNEL_FREE &&
        station.frame == FramesInFlight::NONE)
        channel_.begin_frame(index, robot.now(), robot.outgoing(), false);
    if (station.planned == 0) channel_.next_begin(index) = next_request(robot);
}

/// The earliest moment of a robot's next request. One that waits to be told that the channel is
/// busy tries again soon.
Cycles GuestRobots::next_request(const Robot &robot) {
    return robot.question() != Robot::Question::NONE ? robot.now() : robot.next_ask();
}

/// A frame that a robot sends at its request begins now; later ones begin in their time. Without a
/// request that is taken in its turn, those of this step are found when its events begin.
void GuestRobots::plan_frames(uint32_t index, Cycles requested_at) {
    Robot &robot = context_.robots[index];
    const auto &emissions = robot.emissions();
    auto &station = channel_.in_flight().station(index);
    for (size_t i = 0; i < emissions.size(); i++) {
        const Emission &emission = emissions[i];
        if (emission.at == requested_at) {
            channel_.begin_frame(index, emission.at, emission.message, true);
            continue;
        }
        if (station.planned++ == 0) channel_.next_begin(index) = emission.at;
        const Cycles next = i + 1 < emissions.size() ? emissions[i + 1].at : next_request(robot);
        const bool soon = requested_at != NEVER && emission.at < channel_.end();
        Share &share = soon ? lane_of(index) : shares_[robot.share()];
        PlannedFrames &planned = share.planned;
        if (soon) schedule({emission.at, index, static_cast<uint32_t>(planned_in(share).size())});
        PlannedFrame &frame = planned.add(emission.at, context_.step);
        frame.emission = emission;
        frame.emission.robot = index;
        frame.next = next;
    }
}

// Frames

void GuestRobots::shine(Frame &frame) { channel_.shine_around_robot(frame); }

// The robot has waited for this within its program's interrupt.
void GuestRobots::sensed(const Frame &frame, bool busy) {
    context_.robots[frame.sender].answer(!busy);
}

// The robot has moved its compare value by then: the next request comes within a tick.
void GuestRobots::gave_up(const Frame &frame) {
    lane_of(frame.sender).counts.attempts_failed++;
    schedule({frame.begin + CarrierSense::WINDOW_END + 1, frame.sender});
}

void GuestRobots::sent(const Frame &frame) {
    auto &station = channel_.in_flight().station(frame.sender);
    ChannelCounts &counts = lane_of(frame.sender).counts;
    counts.sent++;
    counts.wrong_crc += !frame.message->crc_is_right();
    station.counts.sent++;
    // With a short period of its own it may be asked again within this step.
    const Cycles over = frame.begin + FRAME_CYCLES, next = channel_.next_begin(frame.sender);
    if (!frame.granted)
        schedule({over, frame.sender});
    else if (next < channel_.end() && station.planned == 0)
        schedule({std::max(over, next), frame.sender});
}

// Whatever becomes of the frame: while its light falls on the receiver sensors cannot be read.
void GuestRobots::light_begins(const Frame &frame, Reached &reached) {
    const auto &station = channel_.in_flight().station(reached.station);
    if (station.is_tentative) bring_back(reached.station, frame);
    if (!station.heeds_light) return;
    context_.robots[reached.station].disturb(frame.begin, frame.begin + FRAME_CYCLES,
                                             frame.message->message());
}

// Each receiver draws for itself, and only for frames that nothing else spoiled.
void GuestRobots::received(const Frame &frame, const Reached &reached) {
    if (!frame.message->crc_is_right()) return;
    ChannelCounts &counts = lane_of(reached.station).counts;
    const bool from_above = frame.above > 0;
    if (reached.fate != Fate::CLEAR) {
        if (from_above) return;
        (reached.fate == Fate::COLLIDED ? counts.collided : counts.deaf)++;
        return;
    }
    const uint32_t index = reached.station;
    auto &station = channel_.in_flight().station(index);
    const uint64_t draw = from_above ? 0 : station.draws++;
    if (!station.in_turn && !from_above && !frame.has_orders && channel_.trail() == nullptr) {
        auto &arrivals = shares_[context_.team.share_of(index, context_.robots.size())].arrivals;
        arrivals.push_back(
            {frame.begin, frame.range_m, draw, index, reached.distance_mm, frame.message->message(),
             std::exchange(station.arrival, static_cast<uint32_t>(arrivals.size()))});
        return;
    }
    if (receiver_.is_lost(frame, reached, draw)) {
        counts.lost += !from_above;
        return;
    }
    (from_above ? counts.above_received : counts.received)++;
    station.counts.received++;
    Robot &robot = context_.robots[index];
    const Cycles end = frame.begin + FRAME_CYCLES;
    if (Trail *const trail = channel_.trail(); trail != nullptr) [[unlikely]]
        trail->arrived(trail->station(frame.sender), trail->station(index), frame.begin, end,
                       frame.message->message());
    robot.receive(end, frame.message->message(), receiver_.measure(frame, reached, draw));
    // It may be ordered to run, and then to send, or to answer, before the others are past that.
    const bool is_asked = frame.message->message().type == BOOTPGM_QUERY;
    if (frame.has_orders && (robot.next_ask() == NEVER || is_asked) && end < channel_.end())
        schedule({end, index});
}

// Memory

void GuestRobots::prefetch(uint32_t robot) const {
    if (channel_.in_flight().station(robot).in_turn) prefetch_receiver(robot);
}

void GuestRobots::prefetch_receiver(uint32_t robot) const {
    receiver_.prefetch(robot);
    context_.robots[robot].prefetch_receiver();
}

// Those whose requests are looked at, and those around them.
void GuestRobots::prefetch_senders_after(const Share &share, size_t i) const {
    constexpr size_t SOON = 4, LATER = 8, LATEST = 14;
    if (!prefetches(context_.robots.size()) || i + LATEST >= share.senders.size()) return;
    const uint32_t latest = share.senders[i + LATEST];
    channel_.in_flight().prefetch(latest);
    context_.robots[latest].prefetch();
    context_.robots[share.senders[i + LATER]].prefetch_ask();
    channel_.prefetch_lookahead(share.senders[i + SOON], share.senders[i + LATER], latest);
}

// Those that are executed first.
void GuestRobots::prefetch_first_after(const Share &share, size_t i) const {
    constexpr size_t LATER = 5, LATEST = 7;
    if (!prefetches(context_.robots.size()) || i + LATEST >= share.first.size()) return;
    const uint32_t latest = share.first[i + LATEST].first;
    context_.robots[latest].prefetch();
    context_.bodies.prefetch(latest);
    channel_.in_flight().prefetch(latest);
    context_.robots[share.first[i + LATER].first].prefetch_state();
}

// The robots that are asked or begin a frame, and those around them.
void GuestRobots::prefetch_events(Share &share) {
    constexpr size_t SOONER = 3, SOON = 6, LATER = 9, LATEST = 12, PLANNED = 18;
    const auto &robots = context_.robots;
    const GuestEvents &events = share.events;
    if (!prefetches(robots.size()) || events.later(PLANNED) == nullptr) return;
    const FramesInFlight &in_flight = channel_.in_flight();
    const Neighbours &lists = context_.bodies.lists();
    // Events are in order of time, the frames that they stand for are not.
    if (const GuestEvent &event = *events.later(PLANNED); !event.is_request())
        prefetch_line(&planned_in(share)[event.frame]);
    const auto &latest = *events.later(LATEST), &later = *events.later(LATER);
    lists.prefetch_place(latest.robot);
    in_flight.prefetch(latest.robot);
    in_flight.prefetch_message(latest.robot);
    channel_.prefetch_next_begin(latest.robot);
    channel_.prefetch_range(latest.robot);
    if (latest.is_request()) robots[latest.robot].prefetch();
    lists.prefetch(later.robot);
    if (later.is_request()) robots[later.robot].prefetch_state();
    const auto &soon = *events.later(SOON);
    for (uint32_t other : lists.of(soon.robot)) {
        in_flight.prefetch(other);
        if (soon.is_request()) channel_.prefetch_next_begin(other);
        context_.bodies.prefetch_place(other);
    }
    const uint32_t sooner = events.later(SOONER)->robot;
    for (uint32_t other : lists.of(sooner))
        if (in_flight.station(other).heeds_light && is_in_range(sooner, other))
            robots[other].prefetch_light();
}

/// Whether a robot that sends in this step or the next reaches another one.
bool GuestRobots::may_be_in_range(uint32_t sender, uint32_t other) const {
    const auto &bodies = context_.bodies;
    const double way_m = 2 * bodies.fastest_m_s() * seconds(context_.step);
    const double most_m = channel_.robot_range_m(sender) + way_m;
    return (bodies.position(other) - bodies.position(sender)).squaredNorm() <= most_m * most_m;
}

bool GuestRobots::is_in_range(uint32_t sender, uint32_t other) const {
    const double range_m = channel_.robot_range_m(sender);
    const auto &bodies = context_.bodies;
    return (bodies.position(other) - bodies.position(sender)).squaredNorm() < range_m * range_m;
}

}  // namespace kilotwin
