#include "infrared/guest_robots.h"

#include <algorithm>
#include <utility>

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
      tentative_(context.robots, context.step) {}

double GuestRobots::range_m(uint32_t robot) const { return channel_.robot_range_m(robot); }

Cycles GuestRobots::next_begin(uint32_t robot) const { return context_.robots[robot].next_ask(); }

// Requests

void GuestRobots::begin_requests() {
    FramesInFlight &in_flight = channel_.in_flight();
    const Cycles begin = channel_.now(), end = channel_.end();
    events_.clear();
    next_ = 0;
    choose(senders_, context_.robots.size(),
           [&](uint32_t robot) { return channel_.next_begin(robot) < end; });
    for (uint32_t robot : senders_) {
        const auto &station = in_flight.station(robot);
        if (station.is_tentative) {
            const Cycles due = tentative_.due(robot);
            const bool over = due < end && !tentative_.has_message(robot);
            if (due >= end || (over && end_tentative_run(robot) >= end)) continue;
            if (!over) {
                events_.push_back({due, What::REQUEST, robot});
                continue;
            }
        }
        if (station.frame == FramesInFlight::NONE && station.planned == 0 && station.kind == KIND)
            events_.push_back({std::max(channel_.next_begin(robot), begin), What::REQUEST, robot});
    }
    const auto &planned = planned_at(begin);
    for (uint32_t i = 0; i < planned.size(); i++)
        events_.push_back({planned[i].emission.at, What::BEGIN, i});
    sorter_.sort(
        events_, begin, context_.step, [](const Event &event) { return event.at; },
        [](const Event &a, const Event &b) { return b > a; });
}

void GuestRobots::end_requests() { planned_.forget(channel_.now(), context_.step); }

/// Adds to the events of this step, or to those of later steps. Most come in order of time.
void GuestRobots::schedule(const Event &event) {
    if (event.at < channel_.end() && (events_.empty() || event > events_.back()))
        events_.push_back(event);
    else
        other_events_.push(event);
}

const GuestRobots::Event *GuestRobots::first_event() const {
    const Event *first = next_ < events_.size() ? &events_[next_] : nullptr;
    if (!other_events_.empty() && (first == nullptr || *first > other_events_.top()))
        first = &other_events_.top();
    return first;
}

Cycles GuestRobots::next_event() const {
    const Event *first = first_event();
    return first != nullptr ? first->at : NEVER;
}

void GuestRobots::take_event() {
    const Event event = turn_ = *first_event();
    if (next_ < events_.size() && !(events_[next_] > event))
        prefetch_after(++next_);
    else
        other_events_.pop();
    if (event.what == What::REQUEST) return take_request(event.number, event.at);
    const auto &[emission, next] = planned_at(event.at)[event.number];
    channel_.in_flight().station(emission.robot).planned--;
    channel_.next_begin(emission.robot) = next;
    channel_.begin_frame(emission.robot, emission.at, emission.message, true);
}

/// Executes a robot through the moment of its request, and on if it can send and then be left
/// alone.
void GuestRobots::take_request(uint32_t index, Cycles at) {
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
        if (alone > end) {
            until = alone;
            robot.grant(at, alone - CarrierSense::WINDOW_END - 1, alone);
        } else {
            robot.grant(at, at, std::min(channel_.limit(), at + 1 + FRAME_CYCLES));
        }
    }
    requested_at_ = at;
    run_on(index, until);
    if (until > channel_.end()) ran_ahead_(index, until);
    const auto &station = channel_.in_flight().station(index);
    const Cycles next = channel_.next_begin(index);
    if (next < channel_.end() && station.frame == FramesInFlight::NONE && station.planned == 0)
        schedule({std::max(next, at + 1), What::REQUEST, index});
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
    if (tentative_.has_message(index) && due < channel_.end())
        schedule({due, What::REQUEST, index});
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
    const bool was_asked = turn_.what == What::REQUEST && turn_.at == frame.begin &&
                           turn_.number == frame.sender && index < frame.sender;
    if (was_asked && next_request(robot) == until) tentative_.go_on(index, ++until);
    context_.bodies.take_back_commands(index, until);
    ran_ahead_(index, until);
    const Cycles next = channel_.next_begin(index) = next_request(robot);
    if (next < channel_.end()) schedule({next, What::REQUEST, index});
}

/// Whether carrier sense is known to find the channel free if the robot's request comes at `at`: it
/// receives nothing, and no station around may begin before its window is over.
bool GuestRobots::is_channel_free(uint32_t index, Cycles at) const {
    const Robot &robot = context_.robots[index];
    if (channel_.carrier_sense().may_be_busy(index) || robot.question() != Robot::Question::NONE ||
        robot.next_ask() != at)
        return false;
    for (uint32_t other : context_.bodies.lists().of(index))
        if (channel_.next_begin(other) <= at + CarrierSense::WINDOW_END) return false;
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
    requested_at_ = NEVER;
    const Cycles request = channel_.next_begin(robot);
    if (request >= channel_.end() && request < until)
        context_.robots[robot].grant(request, until - CarrierSense::WINDOW_END - 1, until);
    run_on(robot, until);
}

/// Executes a robot up to `until`, answering its questions.
void GuestRobots::run_on(uint32_t index, Cycles until) {
    Robot &robot = context_.robots[index];
    for (;;) {
        context_.emissions.clear();
        robot.run_arbitrated(until);
        if (!context_.emissions.empty()) plan_frames(index);
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

/// A frame that a robot sends at its request begins now; later ones begin in their time.
void GuestRobots::plan_frames(uint32_t index) {
    const auto &emissions = context_.emissions;
    auto &station = channel_.in_flight().station(index);
    for (size_t i = 0; i < emissions.size(); i++) {
        const Emission &emission = emissions[i];
        if (emission.at == requested_at_) {
            channel_.begin_frame(index, emission.at, emission.message, true);
            continue;
        }
        if (station.planned++ == 0) channel_.next_begin(index) = emission.at;
        const Cycles next =
            i + 1 < emissions.size() ? emissions[i + 1].at : next_request(context_.robots[index]);
        if (emission.at < channel_.end())
            schedule(
                {emission.at, What::BEGIN, static_cast<uint32_t>(planned_at(emission.at).size())});
        PlannedFrame &frame = planned_.add(emission.at, context_.step);
        frame.emission = emission;
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
    channel_.tally().attempts_failed++;
    schedule({frame.begin + CarrierSense::WINDOW_END + 1, What::REQUEST, frame.sender});
}

void GuestRobots::sent(const Frame &frame) {
    auto &station = channel_.in_flight().station(frame.sender);
    channel_.tally().sent++;
    channel_.tally().wrong_crc += !frame.message->crc_is_right();
    station.counts.sent++;
    // With a short period of its own it may be asked again within this step.
    const Cycles over = frame.begin + FRAME_CYCLES, next = channel_.next_begin(frame.sender);
    if (!frame.granted)
        schedule({over, What::REQUEST, frame.sender});
    else if (next < channel_.end() && station.planned == 0)
        schedule({std::max(over, next), What::REQUEST, frame.sender});
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
    ChannelCounts &tally = channel_.tally();
    const bool from_above = frame.above > 0;
    if (reached.fate != Fate::CLEAR) {
        if (from_above) return;
        (reached.fate == Fate::COLLIDED ? tally.collided : tally.deaf)++;
        return;
    }
    const uint32_t index = reached.station;
    auto &station = channel_.in_flight().station(index);
    const uint64_t draw = from_above ? 0 : station.draws++;
    if (receiver_.is_lost(frame, reached, draw)) {
        tally.lost += !from_above;
        return;
    }
    (from_above ? tally.above_received : tally.received)++;
    station.counts.received++;
    Robot &robot = context_.robots[index];
    const Cycles end = frame.begin + FRAME_CYCLES;
    if (Trail *const trail = channel_.trail(); trail != nullptr) [[unlikely]]
        trail->arrived(trail->station(frame.sender), {Trail::Kind::ROBOT, index}, frame.begin, end,
                       frame.message->message());
    robot.receive(end, frame.message->message(), receiver_.measure(frame, reached, draw));
    // It may be ordered to run, and then to send, or to answer, before the others are past that.
    const bool is_asked = frame.message->message().type == BOOTPGM_QUERY;
    if (frame.has_orders && (robot.next_ask() == NEVER || is_asked) && end < channel_.end())
        schedule({end, What::REQUEST, index});
}

// Memory

void GuestRobots::prefetch(uint32_t robot) const {
    receiver_.prefetch(robot);
    context_.robots[robot].prefetch_receiver();
}

// The robots that are asked or begin a frame, and those around them.
void GuestRobots::prefetch_after(size_t next) {
    constexpr size_t SOONER = 2, SOON = 4, LATER = 6, LATEST = 8, PLANNED = 12;
    const auto &robots = context_.robots;
    if (!prefetches(robots.size()) || next + PLANNED >= events_.size()) return;
    auto is_request = [&](size_t turns) { return events_[next + turns].what == What::REQUEST; };
    // Events are in order of time, the frames that they stand for are not.
    if (const Event &event = events_[next + PLANNED]; event.what == What::BEGIN)
        prefetch_line(&planned_at(event.at)[event.number]);
    const FramesInFlight &in_flight = channel_.in_flight();
    const Neighbours &lists = context_.bodies.lists();
    const uint32_t latest = robot_of(events_[next + LATEST]),
                   later = robot_of(events_[next + LATER]),
                   sooner = robot_of(events_[next + SOONER]);
    lists.prefetch_place(latest);
    in_flight.prefetch(latest);
    in_flight.prefetch_message(latest);
    if (is_request(LATEST)) robots[latest].prefetch();
    lists.prefetch(later);
    if (is_request(LATER)) robots[later].prefetch_state();
    for (uint32_t other : lists.of(robot_of(events_[next + SOON]))) {
        in_flight.prefetch(other);
        channel_.prefetch_next_begin(other);
        context_.bodies.prefetch_place(other);
    }
    for (uint32_t other : lists.of(sooner))
        if (in_flight.station(other).heeds_light && is_in_range(sooner, other))
            robots[other].prefetch_light();
}

uint32_t GuestRobots::robot_of(const Event &event) {
    if (event.what == What::REQUEST) return event.number;
    return planned_at(event.at)[event.number].emission.robot;
}

bool GuestRobots::is_in_range(uint32_t sender, uint32_t other) const {
    const double range_m = channel_.robot_range_m(sender);
    const auto &bodies = context_.bodies;
    return (bodies.position(other) - bodies.position(sender)).squaredNorm() < range_m * range_m;
}

}  // namespace kilotwin
