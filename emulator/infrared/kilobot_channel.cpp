#include "infrared/kilobot_channel.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace kilotwin {

namespace {

constexpr double RANGE_LIMIT = 3;  // of the spread

}  // namespace

KilobotChannel::KilobotChannel(const Settings &settings, const ChannelContext &context,
                               uint32_t others, bool runs_past_requests,
                               GuestRobots::RanAhead ran_ahead)
    : Channel(context),
      settings_(settings),
      receiver_(settings, context.chance, context.robots),
      lanes_(context.team, context.robots.size()),
      in_flight_(context.robots.size() + others + controllers(), lanes_.count()),
      carrier_sense_(settings.carrier_sense, settings.held_busy, in_flight_),
      guests_(*this, context, receiver_, runs_past_requests, std::move(ran_ahead)),
      above_(*this, static_cast<uint32_t>(context.robots.size()) + others, controllers()),
      ends_(lanes_.count()) {
    const auto robots = static_cast<uint32_t>(context.robots.size());
    for (uint32_t robot = 0; robot < robots; robot++) {
        const double spread =
            std::clamp(context.chance.normal(context.robots[robot].index(), Purpose::RANGE, 0),
                       -RANGE_LIMIT, RANGE_LIMIT);
        ranges_m_.push_back(
            static_cast<float>(settings.range_m * (1 + spread * settings.range_spread)));
        in_flight_.station(robot).heeds_light = context.robots[robot].heeds_light();
    }
    assign(guests_, 0, robots);
    assign(above_, robots + others, controllers());
}

double KilobotChannel::reach_m(const Settings &settings) {
    return settings.range_m * (1 + RANGE_LIMIT * settings.range_spread);
}

// Kinds are found again by their address: one kind may be given several ranges.
void KilobotChannel::assign(Stations &kind, uint32_t first, uint32_t count) {
    constexpr size_t MOST = std::numeric_limits<decltype(FramesInFlight::Station::kind)>::max() + 1;
    const auto at = std::find(kinds_.begin(), kinds_.end(), &kind);
    const auto number = static_cast<size_t>(at - kinds_.begin());
    if (number == MOST)
        throw std::length_error("too many kinds of stations for FramesInFlight::Station::kind");
    if (number == kinds_.size()) kinds_.push_back(&kind);
    for (uint32_t station = first; station < first + count; station++)
        in_flight_.station(station).kind =
            static_cast<decltype(FramesInFlight::Station::kind)>(number);
}

// The other kinds know when theirs may begin only once they have been executed.
void KilobotChannel::boot(Cycles now) {
    Channel::boot(now);
    lists_changed();
    for (uint32_t robot = 0; robot < next_begin_.size(); robot++)
        next_begin_[robot] = kind_of(robot).next_begin(robot);
}

void KilobotChannel::failed(uint32_t robot) {
    in_flight_.station(robot).is_deaf = context_.robots[robot].is_deaf();
    in_flight_.station(robot).is_mute = context_.robots[robot].is_mute();
}

// Robots only: cells are counted by the grid.
std::vector<FrameCounts> KilobotChannel::frames() const {
    std::vector<FrameCounts> counts;
    counts.reserve(context_.robots.size());
    for (uint32_t robot = 0; robot < context_.robots.size(); robot++)
        counts.push_back(in_flight_.station(robot).counts);
    return counts;
}

void KilobotChannel::lists_changed() {
    lanes_.lists_changed(context_.bodies.lists());
    has_new_lists_ = true;
}

void KilobotChannel::run(Cycles begin, Cycles end, Cycles limit) {
    begin_step(begin, end);
    limit_ = limit;
    guests_.run_first();
    const bool is_cut = cut();
    if (lanes_.count() > 1) change_lanes();
    if (is_cut) context_.team.share([this](uint32_t share) { run_lane(share); });
    run_lane(lanes_.joint());
    guests_.end_requests();
}

/// Finds the lanes of the current step: whether there are others than the joint one. There are not
/// with light from elsewhere, nor where what happens is told in order of time.
bool KilobotChannel::cut() {
    if (lanes_.count() == 1 || !has_guests_only() || context_.team.works_alone() ||
        above_.next() < end_ || is_far_light_on()) {
        lanes_.join();
        return false;
    }
    has_new_lists_ = false;
    guests_.give_later_turns();
    return lanes_.cut(context_.bodies.lists(), [this](uint32_t robot) {
        const auto &station = in_flight_.station(robot);
        return next_begin_[robot] < end_ || station.in_turn ||
               station.frame != FramesInFlight::NONE;
    });
}

/// Whether a frame on air is not a robot's, or reaches one that is not in its sender's list: with
/// new lists a robot may have been put elsewhere.
bool KilobotChannel::is_far_light_on() const {
    auto is_far = [this](uint32_t sender) {
        if (sender >= robots()) return true;
        if (!has_new_lists_) return false;
        const Neighbours::List list = context_.bodies.lists().of(sender);
        const auto &reached = in_flight_[in_flight_.station(sender).frame].reached;
        return !std::all_of(reached.begin(), reached.end(), [&](const Reached &one) {
            return std::binary_search(list.begin(), list.end(), one.station);
        });
    };
    for (const LaneEnds &lane : ends_)
        for (const Ends *ends : {&lane.windows, &lane.frames})
            for (size_t i = 0; i < ends->size(); i++)
                if (is_far(ends->sender(i))) return true;
    return false;
}

/// Windows and frames that began in an earlier step go to their lanes of this one.
void KilobotChannel::change_lanes() {
    std::vector<End> windows, frames;
    for (uint32_t lane = 0; lane < lanes_.count(); lane++) {
        auto is_here = [&](uint32_t sender) { return lanes_.of(sender) == lane; };
        ends_[lane].windows.keep(is_here, windows);
        ends_[lane].frames.keep(is_here, frames);
    }
    for (const End &end : windows) ends_of(end.sender).windows.push(end);
    for (const End &end : frames) ends_of(end.sender).frames.push(end);
    in_flight_.share_free();
    guests_.change_lanes();
}

/// Takes all events of a lane in this step.
void KilobotChannel::run_lane(uint32_t lane) {
    auto &[window_ends, frame_ends] = ends_[lane];
    guests_.begin_events(lane);
    for (;;) {
        // At the same time frames end first, then windows, then frames begin.
        const Cycles ends = frame_ends.next(), windows = window_ends.next(), above = above_.next(),
                     guests = guests_.next_event(lane);
        const Cycles next = std::min({ends, windows, above, guests, end_});
        if (!others_.empty() && run_others(next)) continue;
        if (next == end_) break;
        if (ends == next) {
            const uint32_t sender = frame_ends.sender();
            frame_ends.pop();
            prefetch_frame_ends(frame_ends);
            end_frame(sender);
        } else if (windows == next) {
            end_window(window_ends);
        } else if (above == next) {
            above_.begin_next();
        } else {
            guests_.take_event(lane);
        }
    }
}

// First the senders' records, which say where frames are, then frames, which say whom they reached,
// then what the channel and what a kind of stations keeps of these.
void KilobotChannel::prefetch_frame_ends(const Ends &ends) {
    constexpr size_t SOONER = 3, SOON = 6, LATER = 9, LATEST = 12;
    if (!prefetches(context_.robots.size()) || ends.size() <= LATEST) return;
    const uint32_t latest = ends.sender(LATEST);
    in_flight_.prefetch(latest);
    in_flight_.prefetch_message(latest);
    in_flight_.prefetch_frame(ends.sender(LATER));
    for (const Reached &reached : in_flight_.of(ends.sender(SOON)).reached)
        in_flight_.prefetch(reached.station);
    for (const Reached &reached : in_flight_.of(ends.sender(SOONER)).reached)
        kind_of(reached.station).prefetch(reached.station);
}

/// Executes stations of other kinds up to `next`. Stations receive one another: none may get ahead.
/// True if there is more to do before `next`.
bool KilobotChannel::run_others(Cycles next) {
    Cycles turn = next;
    if (others_.size() > 1)
        for (const Stations *kind : others_) turn = std::min(turn, kind->next_turn());
    for (Stations *kind : others_)
        if (kind->run(turn, next)) return true;
    return turn + 1 < next;
}

Cycles KilobotChannel::lookahead(uint32_t robot, Cycles useful, Cycles limit) const {
    if (!has_lookahead_ || carrier_sense_.may_be_busy(robot)) return end_;
    const Cycles until = std::min(limit, context_.bodies.lists_hold_until());
    if (until <= end_) return end_;
    // Each has its own range, and light falls on a receiver at once.
    auto range_of = [this](uint32_t other) { return ranges_m_[other]; };
    auto begin_of = [this](uint32_t other) { return next_begin_[other]; };
    const Cycles matters =
        first_light(robot, useful, end_of_step(until, context_.step), range_of, begin_of);
    return guests_.alone_until(robot, std::min(until, matters));
}

bool KilobotChannel::others_begin_near(uint32_t robot, Cycles until) const {
    return above_.next() <= until ||
           std::any_of(others_.begin(), others_.end(),
                       [&](const Stations *kind) { return kind->begins_near(robot, until); });
}

void KilobotChannel::begin_frame(uint32_t sender, Cycles at, const message_t &message,
                                 bool granted) {
    Frame &frame = begin_light(sender, at, message);
    frame.granted = granted;
    hold_receivers(frame, at, at + (granted ? FRAME_CYCLES : CarrierSense::WINDOW_END));
    first_pulse(sender, at);
    if (granted) {
        other_pulses(sender, at, message);
        complete_later(frame);
    } else {
        sense(frame);
    }
}

// Pulses of an earlier frame of the same sender are over by now.
Frame &KilobotChannel::begin_light(uint32_t sender, Cycles at, const message_t &message) {
    Stations &kind = kind_of(sender);
    Frame &frame =
        in_flight_.put_on_air(sender, at, kind.range_m(sender), message, lanes_.of(sender));
    for (Stations *other : others_) other->forget_reached(sender);
    kind.shine(frame);
    return frame;
}

// Receivers are found as robots stand at the begin of the step: within one they move by a small
// part of their range.
void KilobotChannel::shine_around_robot(Frame &frame) {
    if (settings_.half_duplex) in_flight_.deafen(frame.sender);
    if (in_flight_.station(frame.sender).is_mute) return;
    const Bodies &bodies = context_.bodies;
    const Eigen::Vector2d here = bodies.position(frame.sender);
    for (uint32_t other : bodies.lists().of(frame.sender)) {
        const Eigen::Vector2d &there = bodies.position(other);
        const double distance = (there - here).norm();
        if (distance <= frame.range_m && bodies.arena().lets_light_pass(here, there))
            shine_on_robot(frame, other, distance);
    }
    for (Stations *kind : others_) kind->shine_from_robot(frame, here);
}

// A frame that begins where there is light already collides with that, and spoils it.
void KilobotChannel::shine_on_robot(Frame &frame, uint32_t robot, double distance_m) {
    if (in_flight_.station(robot).is_deaf) return;
    Reached reached = {robot, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    if (settings_.half_duplex && in_flight_.is_on_air(robot)) reached.fate = Fate::DEAF;
    if (settings_.collisions && !in_flight_.is_dark(robot)) {
        if (reached.fate == Fate::CLEAR) reached.fate = Fate::COLLIDED;
        in_flight_.spoil(robot);
    }
    kind_of(robot).light_begins(frame, reached);
    in_flight_.reach(frame, reached);
}

void KilobotChannel::sense(const Frame &frame) {
    ends_of(frame.sender).windows.push({frame.begin + CarrierSense::WINDOW_END, frame.sender});
}

void KilobotChannel::complete_later(const Frame &frame) {
    ends_of(frame.sender).frames.push({frame.begin + FRAME_CYCLES, frame.sender});
}

// Granted frames have no window: their pulses were sent at the begin.
void KilobotChannel::end_window(Ends &window_ends) {
    const uint32_t sender = window_ends.sender();
    window_ends.pop();
    const Frame &frame = in_flight_.of(sender);
    const bool busy = carrier_sense_.finds_busy(frame);
    kind_of(sender).sensed(frame, busy);
    if (busy) {
        give_up(sender);
        return;
    }
    other_pulses(sender, frame.begin, frame.message->message());
    hold_receivers(frame, frame.begin + CarrierSense::WINDOW_END, frame.begin + FRAME_CYCLES);
    complete_later(frame);
}

void KilobotChannel::give_up(uint32_t sender) {
    const Frame &frame = in_flight_.of(sender);
    in_flight_.take_off_air(frame, lanes_.of(sender));
    kind_of(sender).gave_up(frame);
}

// Off the air first: what receivers do next may begin a frame of theirs.
void KilobotChannel::end_frame(uint32_t sender) {
    const Frame &frame = in_flight_.of(sender);
    in_flight_.take_off_air(frame, lanes_.of(sender));
    for (const Reached &reached : frame.reached) kind_of(reached.station).received(frame, reached);
    kind_of(sender).sent(frame);
}

void KilobotChannel::hold_receivers(const Frame &frame, Cycles begin, Cycles end) {
    for (Stations *kind : others_) kind->hold_receivers(frame, begin, end);
}

void KilobotChannel::first_pulse(uint32_t sender, Cycles at) {
    for (Stations *kind : others_) kind->first_pulse(sender, at);
}

void KilobotChannel::other_pulses(uint32_t sender, Cycles at, const message_t &message) {
    for (Stations *kind : others_) kind->other_pulses(sender, at, message);
}

}  // namespace kilotwin
