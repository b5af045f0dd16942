#include "grid/can_bus.h"

#include <algorithm>
#include <cassert>

namespace kilotwin {

namespace {

// ISO 11898-1, fault confinement: limits of the error counters, and the 128 sequences of 11
// recessive bits after which a bus-off node takes part again.
constexpr uint32_t ERROR_PASSIVE_FROM = 128, BUS_OFF_FROM = 256, ERROR_COUNTER_MAX = 255;
constexpr uint32_t TRANSMIT_ERROR_STEP = 8;
constexpr uint32_t RECOVERY_SEQUENCES = 128;
constexpr Cycles SEQUENCE = 11 * CAN_BIT_CYCLES;
// The acknowledge delimiter and the end of frame.
constexpr Cycles BITS_BEHIND_ACKNOWLEDGE = 1 + 7;
constexpr Cycles ERROR_FLAG_BITS = 6, ERROR_DELIMITER_BITS = 8;

// Orders of the two heaps. std::push_heap keeps the greatest in front, so these say which of two
// heads is served later.
bool later_ready(const auto &a, const auto &b) {
    return a.id != b.id ? a.id > b.id : a.node > b.node;
}

bool later_waiting(const auto &a, const auto &b) {
    return a.at != b.at ? a.at > b.at : later_ready(a, b);
}

}  // namespace

CanBus::CanBus(const Settings &settings, const Chance &chance, uint32_t bus)
    : error_share_(settings.error_share),
      chance_(chance),
      bus_(bus),
      accepting_(CanFrame::ID_MAX + 1),
      accepting_known_(CanFrame::ID_MAX + 1) {}

uint32_t CanBus::attach(const Node &node) {
    NodeState state;
    state.name = node.name;
    state.most = node.tx_queue;
    state.filters = node.filters;
    nodes_.push_back(std::move(state));
    live_++;
    accepting_known_.assign(accepting_known_.size(), false);
    return static_cast<uint32_t>(nodes_.size() - 1);
}

double CanBus::load(Cycles now) const {
    return now == 0 ? 0 : static_cast<double>(counts_.busy) / static_cast<double>(now);
}

// Queues

bool CanBus::queue(uint32_t index, Cycles at, const CanFrame &frame) {
    assert(frame.id <= CanFrame::ID_MAX && frame.dlc <= CanFrame::DATA_MAX);
    NodeState &node = nodes_[index];
    if (!lives(index)) {
        (node.state == State::DEAD ? counts_.lost_dead : counts_.lost_bus_off)++;
        return false;
    }
    if (node.size == node.most) {
        counts_.lost_queue_full++;
        return false;
    }
    if (node.size == node.ring.size()) {
        std::rotate(node.ring.begin(), node.ring.begin() + static_cast<ptrdiff_t>(node.first),
                    node.ring.end());
        node.first = 0;
        // Most queues stay short; a grid has hundreds.
        node.ring.resize(std::min(node.most, std::max<size_t>(4, 2 * node.ring.size())));
    }
    node.ring[(node.first + node.size++) % node.ring.size()] = {
        at, frame, static_cast<uint16_t>(can_frame_bits(frame))};
    if (node.size == 1) add_head(index, 0);
    return true;
}

void CanBus::add_head(uint32_t node, Cycles not_before) {
    const Queued &queued = head(node);
    Head entry = {std::max(queued.at, not_before), queued.frame.id, node};
    if (!on_wire_ && entry.at <= free_at_) {
        ready_.push_back(entry);
        std::push_heap(ready_.begin(), ready_.end(), later_ready<Head, Head>);
    } else {
        waiting_.push_back(entry);
        std::push_heap(waiting_.begin(), waiting_.end(), later_waiting<Head, Head>);
    }
}

/// Takes a node's head out of whichever heap holds it. Rebuilds both heaps: only for faults.
void CanBus::remove_head(uint32_t node) {
    auto is_its = [node](const Head &entry) { return entry.node == node; };
    std::erase_if(ready_, is_its);
    std::erase_if(waiting_, is_its);
    std::make_heap(ready_.begin(), ready_.end(), later_ready<Head, Head>);
    std::make_heap(waiting_.begin(), waiting_.end(), later_waiting<Head, Head>);
}

void CanBus::drop_queue(uint32_t index, uint64_t &lost) {
    NodeState &node = nodes_[index];
    lost += node.size;
    node.first = node.size = 0;
    remove_head(index);
}

// Attempts to send, one after the other

Cycles CanBus::next() const {
    // A lone node is never acknowledged: it tries for ever.
    if (live_ < 2) return NEVER;
    if (on_wire_) return end_;
    if (ready_.empty() && waiting_.empty()) return NEVER;
    const Head &first = ready_.empty() ? waiting_.front() : ready_.front();
    return std::max(first.at, free_at_) + head(first.node).bits * CAN_BIT_CYCLES;
}

const CanBus::Delivery *CanBus::step(Cycles until) {
    for (;;) {
        if (!on_wire_ && !begin_attempt(until)) return nullptr;
        if (end_ >= until) return nullptr;
        if (outcome_ == Outcome::ARRIVES) return end_delivered();
        end_failed();
    }
}

/// Arbitration: the lowest identifier among the frames that may begin when the bus falls idle
/// begins, if that is before `until`.
bool CanBus::begin_attempt(Cycles until) {
    if (ready_.empty()) {
        Cycles begin = waiting_.empty() ? NEVER : waiting_.front().at;
        if (begin >= until) {
            recover_until(until, false);
            return false;
        }
        free_at_ = begin;
        while (!waiting_.empty() && waiting_.front().at == begin) {
            std::pop_heap(waiting_.begin(), waiting_.end(), later_waiting<Head, Head>);
            ready_.push_back(waiting_.back());
            std::push_heap(ready_.begin(), ready_.end(), later_ready<Head, Head>);
            waiting_.pop_back();
        }
    }
    if (free_at_ >= until) return false;
    recover_until(free_at_, true);
    std::pop_heap(ready_.begin(), ready_.end(), later_ready<Head, Head>);
    sender_ = ready_.back().node;
    ready_.pop_back();
    on_wire_ = true;
    begin_ = free_at_;
    settle_outcome();
    return true;
}

/// Draws how the attempt that has just begun will end, and when.
void CanBus::settle_outcome() {
    const Cycles bits = head(sender_).bits;
    outcome_ = Outcome::ARRIVES;
    end_ = begin_ + bits * CAN_BIT_CYCLES;
    if (error_share_ > 0) {
        uint64_t draw = 2 * attempts_++;
        if (chance_.uniform(bus_, Purpose::CAN_ERROR, draw) < error_share_) {
            double place = chance_.uniform(bus_, Purpose::CAN_ERROR, draw + 1);
            Cycles bits_before = 1 + static_cast<Cycles>(place * static_cast<double>(bits));
            outcome_ = Outcome::DISTURBED;
            end_ = begin_ + (bits_before + CAN_ERROR_FRAME_BITS) * CAN_BIT_CYCLES;
            return;
        }
    }
    if (live_ > 1) return;
    // The sender's error flag follows the recessive acknowledge slot at once.
    outcome_ = Outcome::NOT_ACKNOWLEDGED;
    end_ += (ERROR_FLAG_BITS + ERROR_DELIMITER_BITS) * CAN_BIT_CYCLES -
            BITS_BEHIND_ACKNOWLEDGE * CAN_BIT_CYCLES;
}

const CanBus::Delivery *CanBus::end_delivered() {
    NodeState &node = nodes_[sender_];
    on_wire_ = false;
    counts_.frames++;
    delivery_ = {begin_, end_, sender_, head(sender_).frame, nullptr};
    delivery_.receivers = receivers(delivery_.frame);
    node.first = (node.first + 1) % node.ring.size();
    node.size--;
    if (node.transmit_errors > 0) {
        node.transmit_errors--;
        update_state(sender_);
    }
    count_receptions(sender_);
    free_bus(end_, end_ - BITS_BEHIND_ACKNOWLEDGE * CAN_BIT_CYCLES);
    return &delivery_;
}

void CanBus::end_failed() {
    on_wire_ = false;
    counts_.error_frames++;
    if (outcome_ == Outcome::NOT_ACKNOWLEDGED) {
        counts_.not_acknowledged++;
        // The exception for error passive nodes whose passive flag meets no dominant bit: a lone
        // node stops counting here and never goes bus-off.
        if (nodes_[sender_].state == State::ERROR_ACTIVE)
            count_transmit_error(sender_, TRANSMIT_ERROR_STEP);
    } else {
        count_receive_errors(sender_);
        if (outcome_ == Outcome::DISTURBED) count_transmit_error(sender_, TRANSMIT_ERROR_STEP);
    }
    free_bus(end_, end_ - ERROR_DELIMITER_BITS * CAN_BIT_CYCLES);
}

/// Ends an attempt: intermission, and the heads that may begin behind it. `recessive_from`: where
/// the last run of recessive bits, which bus-off nodes count, began.
void CanBus::free_bus(Cycles end, Cycles recessive_from) {
    free_at_ = end + CAN_INTERMISSION_BITS * CAN_BIT_CYCLES;
    counts_.busy += free_at_ - begin_;
    for (Recovery &recovery : recoveries_) recovery.from = std::max(recovery.from, recessive_from);
    while (!waiting_.empty() && waiting_.front().at <= free_at_) {
        std::pop_heap(waiting_.begin(), waiting_.end(), later_waiting<Head, Head>);
        ready_.push_back(waiting_.back());
        std::push_heap(ready_.begin(), ready_.end(), later_ready<Head, Head>);
        waiting_.pop_back();
    }
    if (!lives(sender_) || nodes_[sender_].size == 0) return;
    // Suspend transmission: an error passive sender lets all others go first.
    bool suspended = nodes_[sender_].state == State::ERROR_PASSIVE;
    add_head(sender_, suspended ? free_at_ + CAN_SUSPEND_BITS * CAN_BIT_CYCLES : 0);
}

// Acceptance filters

const std::vector<uint32_t> &CanBus::accepting(uint16_t id) {
    auto &list = accepting_[id];
    if (accepting_known_[id]) return list;
    list.clear();
    for (uint32_t index = 0; index < nodes_.size(); index++) {
        const auto &filters = nodes_[index].filters;
        bool accepts =
            filters.empty() || std::any_of(filters.begin(), filters.end(), [id](auto &f) {
                return (id & f.second) == (f.first & f.second);
            });
        if (accepts) list.push_back(index);
    }
    accepting_known_[id] = true;
    return list;
}

const std::vector<uint32_t> *CanBus::receivers(const CanFrame &frame) {
    const auto &all = accepting(frame.id);
    bool sender_too = std::binary_search(all.begin(), all.end(), sender_);
    // The usual case shares one list with all frames of the identifier.
    if (!sender_too && live_ == nodes_.size() && youngest_ <= begin_) return &all;
    some_accepting_.clear();
    for (uint32_t node : all)
        if (node != sender_ && lives(node) && nodes_[node].since <= begin_)
            some_accepting_.push_back(node);
    return &some_accepting_;
}

// Error counters

void CanBus::count_transmit_error(uint32_t index, uint32_t by) {
    NodeState &node = nodes_[index];
    node.transmit_errors += by;
    if (node.transmit_errors >= BUS_OFF_FROM)
        go_bus_off(index, end_);
    else
        update_state(index);
}

void CanBus::count_receive_errors(uint32_t sender) {
    for (uint32_t index = 0; index < nodes_.size(); index++) {
        NodeState &node = nodes_[index];
        if (index == sender || !lives(index) || node.receive_errors == ERROR_COUNTER_MAX) continue;
        if (node.receive_errors++ == 0) erring_.push_back(index);
        update_state(index);
    }
}

/// Every node but the sender has received one more frame without an error.
void CanBus::count_receptions(uint32_t sender) {
    // ISO 11898-1: a value between 119 and 127, so that the node is error active again.
    constexpr uint32_t AFTER_PASSIVE = 119;
    std::erase_if(erring_, [&](uint32_t index) {
        NodeState &node = nodes_[index];
        if (index != sender && node.receive_errors > 0) {
            node.receive_errors =
                node.receive_errors >= ERROR_PASSIVE_FROM ? AFTER_PASSIVE : node.receive_errors - 1;
            update_state(index);
        }
        return node.receive_errors == 0;
    });
}

void CanBus::update_state(uint32_t index) {
    NodeState &node = nodes_[index];
    if (!lives(index)) return;
    bool passive = std::max(node.transmit_errors, node.receive_errors) >= ERROR_PASSIVE_FROM;
    node.state = passive ? State::ERROR_PASSIVE : State::ERROR_ACTIVE;
}

// Faults and recovery

/// Takes a live node off the bus, into `state`; its queued frames are added to `lost`. An attempt
/// on the wire ends otherwise if the node is its sender, or the last one to acknowledge it.
void CanBus::leave(uint32_t index, State state, Cycles at, uint64_t &lost) {
    nodes_[index].state = state;
    nodes_[index].receive_errors = 0;
    std::erase(erring_, index);
    live_--;
    drop_queue(index, lost);
    if (!on_wire_) return;
    if (index == sender_) {
        // The others read six recessive bits as an error.
        outcome_ = Outcome::BROKEN_OFF;
        end_ = std::max(at, begin_) + (ERROR_FLAG_BITS + CAN_ERROR_FRAME_BITS) * CAN_BIT_CYCLES;
    } else if (live_ == 1 && outcome_ == Outcome::ARRIVES) {
        Cycles acknowledged = end_ - BITS_BEHIND_ACKNOWLEDGE * CAN_BIT_CYCLES;
        if (at >= acknowledged) return;
        outcome_ = Outcome::NOT_ACKNOWLEDGED;
        end_ = acknowledged + (ERROR_FLAG_BITS + ERROR_DELIMITER_BITS) * CAN_BIT_CYCLES;
    }
}

void CanBus::kill(uint32_t node, Cycles at) {
    if (nodes_[node].state == State::DEAD) return;
    std::erase_if(recoveries_, [node](const Recovery &r) { return r.node == node; });
    if (lives(node)) leave(node, State::DEAD, at, counts_.lost_dead);
    nodes_[node].state = State::DEAD;
    nodes_[node].held = false;
    nodes_[node].transmit_errors = 0;
}

void CanBus::bus_off(uint32_t node, Cycles at, bool held) {
    if (nodes_[node].state == State::DEAD) return;
    if (lives(node)) go_bus_off(node, at);
    if (!held) return;
    nodes_[node].held = true;
    std::erase_if(recoveries_, [node](const Recovery &r) { return r.node == node; });
}

void CanBus::go_bus_off(uint32_t node, Cycles at) {
    leave(node, State::BUS_OFF, at, counts_.lost_bus_off);
    nodes_[node].transmit_errors = BUS_OFF_FROM;
    counts_.went_bus_off++;
    recoveries_.push_back({node, at, RECOVERY_SEQUENCES});
}

void CanBus::recover(uint32_t node, Cycles at) {
    NodeState &state = nodes_[node];
    if (state.state == State::DEAD) {
        revive(node, at);
    } else if (state.held) {
        state.held = false;
        recoveries_.push_back({node, at, RECOVERY_SEQUENCES});
    }
}

void CanBus::revive(uint32_t node, Cycles at) {
    NodeState &state = nodes_[node];
    state.state = State::ERROR_ACTIVE;
    state.transmit_errors = state.receive_errors = 0;
    state.since = at;
    youngest_ = std::max(youngest_, at);
    live_++;
}

/// Counts the recessive bits up to `until` for bus-off nodes, in whole sequences of 11.
/// `gap_ends`: a frame begins at `until`, so that a sequence it interrupts is lost.
void CanBus::recover_until(Cycles until, bool gap_ends) {
    std::erase_if(recoveries_, [&](Recovery &recovery) {
        Cycles sequences = until > recovery.from ? (until - recovery.from) / SEQUENCE : 0;
        if (sequences >= recovery.remaining) {
            revive(recovery.node, recovery.from + recovery.remaining * SEQUENCE);
            return true;
        }
        if (gap_ends) recovery.remaining -= static_cast<uint32_t>(sequences);
        return false;
    });
}

}  // namespace kilotwin
