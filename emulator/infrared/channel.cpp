#include "infrared/channel.h"

#include "infrared/station.h"

namespace kilotwin {

ChannelCounts &ChannelCounts::operator+=(const ChannelCounts &more) {
    sent += more.sent;
    received += more.received;
    wrong_crc += more.wrong_crc;
    attempts_failed += more.attempts_failed;
    collided += more.collided;
    deaf += more.deaf;
    lost += more.lost;
    above_sent += more.above_sent;
    above_received += more.above_received;
    above_reached += more.above_reached;
    return *this;
}

Channel::Channel(const ChannelContext &context)
    : context_(context),
      next_begin_(context.robots.size(), 0) {}

void Channel::add(Stations &stations) {
    others_.push_back(&stations);
    has_lookahead_ &= stations.has_lookahead();
}

void Channel::boot(Cycles now) {
    for (Stations *kind : others_) kind->boot(now);
}

void Channel::host_silent_until(Cycles until) {
    for (Stations *kind : others_) kind->host_silent_until(until);
}

Cycles Channel::next_light() const {
    Cycles next = next_from_above();
    for (const Stations *kind : others_) next = std::min(next, kind->next_light());
    return next;
}

void Channel::begin_step(Cycles begin, Cycles end) {
    now_ = begin;
    end_ = end;
    for (Stations *kind : others_) kind->begin_step(begin);
}

}  // namespace kilotwin
