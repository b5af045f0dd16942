#include "grid/can_bus.h"

#include <algorithm>
#include <cassert>

namespace kilotwin {

namespace {

constexpr uint32_t ERROR_PASSIVE_FROM = 128, BUS_OFF_FROM = 256, ERROR_COUNTER_MAX = 255;
constexpr uint32_t RECOVERY_SEQUENCES = 128;
constexpr Cycles SEQUENCE = 11 * CAN_BIT_CYCLES;
// Behind the checksum: its delimiter, acknowledge slot and delimiter, end of frame.
constexpr uint32_t TRAILER_BITS = 1 + 1 + 1 + 7;
constexpr Cycles BITS_BEHIND_ACKNOWLEDGE = 1 + 7;
constexpr Cycles ERROR_FLAG_BITS = 6, ERROR_DELIMITER_BITS = 8;
constexpr uint32_t CRC_BITS = 15;
constexpr uint16_t CRC_POLYNOMIAL = 0x4599;

/// Checksums of all bytes, so that a frame needs no loop over its bits.
struct CrcTable {
    uint16_t of[256] = {};
    constexpr CrcTable() {
        for (uint32_t byte = 0; byte < 256; byte++) {
            uint32_t crc = byte << (CRC_BITS - 8);
            for (int bit = 0; bit < 8; bit++)
                crc = (crc & 0x4000) != 0 ? crc << 1 ^ CRC_POLYNOMIAL : crc << 1;
            of[byte] = crc & 0x7FFF;
        }
    }
};
constexpr CrcTable CRC;

/// The sender's bit stuffing as a machine that takes a byte a step. Its state is the last bit on
/// the wire and how many equal ones, itself included, came in a row: 1 to 5 of zeros are states 0
/// to 4, of ones 5 to 9.
struct StuffTable {
    static constexpr uint32_t STATES = 10, RUN_MAX = 5;
    uint8_t next[STATES][256] = {};
    uint8_t stuffed[STATES][256] = {};

    static constexpr uint32_t state_of(uint32_t bit, uint32_t run) {
        return bit * RUN_MAX + run - 1;
    }

    /// The state after `bit`; one more in `count` if a stuff bit went ahead of it.
    static constexpr uint32_t after(uint32_t state, uint32_t bit, uint32_t &count) {
        uint32_t last = state / RUN_MAX, run = state % RUN_MAX + 1;
        if (run == RUN_MAX) {
            count++;
            last = 1 - last;
            run = 1;
        }
        return bit == last ? state_of(bit, run + 1) : state_of(bit, 1);
    }

    constexpr StuffTable() {
        for (uint32_t state = 0; state < STATES; state++)
            for (uint32_t byte = 0; byte < 256; byte++) {
                uint32_t now = state, count = 0;
                for (int bit = 7; bit >= 0; bit--) now = after(now, byte >> bit & 1, count);
                next[state][byte] = static_cast<uint8_t>(now);
                stuffed[state][byte] = static_cast<uint8_t>(count);
            }
    }
};
constexpr StuffTable STUFF;

/// Start of frame (0), identifier, remote bit, two reserved bits, data length: 19 bits.
uint32_t header_of(const CanFrame &frame) {
    return static_cast<uint32_t>(frame.id) << 7 | static_cast<uint32_t>(frame.rtr) << 6 | frame.dlc;
}

size_t data_bytes(const CanFrame &frame) { return frame.rtr ? 0 : frame.dlc; }

uint16_t crc_step(uint16_t crc, uint8_t byte) {
    return static_cast<uint16_t>((crc << 8 & 0x7FFF) ^
                                 CRC.of[(crc >> (CRC_BITS - 8) ^ byte) & 0xFF]);
}

}  // namespace

uint16_t can_crc15(const CanFrame &frame) {
    // Zeros ahead of it, up to whole bytes, do not change a checksum that begins with 0.
    uint32_t header = header_of(frame);
    uint16_t crc = crc_step(0, static_cast<uint8_t>(header >> 16));
    crc = crc_step(crc, static_cast<uint8_t>(header >> 8));
    crc = crc_step(crc, static_cast<uint8_t>(header));
    for (size_t i = 0; i < data_bytes(frame); i++) crc = crc_step(crc, frame.data[i]);
    return crc;
}

uint32_t can_frame_bits(const CanFrame &frame) {
    uint32_t header = header_of(frame), stuffed = 0, state = STUFF.state_of(0, 1);
    auto take_bit = [&](uint32_t bit) { state = STUFF.after(state, bit, stuffed); };
    auto take = [&](uint32_t byte) {
        stuffed += STUFF.stuffed[state][byte];
        state = STUFF.next[state][byte];
    };
    // The start of frame is the first state; 18 bits of header remain.
    take_bit(header >> 17 & 1);
    take_bit(header >> 16 & 1);
    take(header >> 8 & 0xFF);
    take(header & 0xFF);
    for (size_t i = 0; i < data_bytes(frame); i++) take(frame.data[i]);
    uint16_t crc = can_crc15(frame);
    take(crc >> 7);
    for (int bit = 6; bit >= 0; bit--) take_bit(crc >> bit & 1);
    // A run of five that ends the checksum is followed by a stuff bit too.
    if (state % StuffTable::RUN_MAX == StuffTable::RUN_MAX - 1) stuffed++;
    return 19 + 8 * static_cast<uint32_t>(data_bytes(frame)) + CRC_BITS + stuffed + TRAILER_BITS;
}

namespace {

// As std::push_heap wants them: what comes last.
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
      takers_(CanFrame::ID_MAX + 1),
      takers_known_(CanFrame::ID_MAX + 1) {}

uint32_t CanBus::attach(const Node &node) {
    NodeState state;
    state.name = node.name;
    state.most = node.tx_queue;
    state.filters = node.filters;
    nodes_.push_back(std::move(state));
    live_++;
    takers_known_.assign(takers_known_.size(), false);
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

/// Forgets a node's head in both heaps, without order: only for faults.
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

// One attempt after the other

Cycles CanBus::next() const {
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

/// Lets the winner of the arbitration begin, if that is before `until`.
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

/// How the attempt that has just begun will end, and when.
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
        // An error passive node's flag meets no dominant bit, so it counts no further: a lone node
        // does not go bus-off.
        if (nodes_[sender_].state == State::ERROR_ACTIVE) count_transmit_error(sender_, 8);
    } else {
        count_receive_errors(sender_);
        if (outcome_ == Outcome::DISTURBED) count_transmit_error(sender_, 8);
    }
    free_bus(end_, end_ - ERROR_DELIMITER_BITS * CAN_BIT_CYCLES);
}

/// The attempt is over: intermission, and who may begin after it.
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
    bool suspended = nodes_[sender_].state == State::ERROR_PASSIVE;
    add_head(sender_, suspended ? free_at_ + CAN_SUSPEND_BITS * CAN_BIT_CYCLES : 0);
}

// Who receives

const std::vector<uint32_t> &CanBus::takers(uint16_t id) {
    auto &list = takers_[id];
    if (takers_known_[id]) return list;
    list.clear();
    for (uint32_t index = 0; index < nodes_.size(); index++) {
        const auto &filters = nodes_[index].filters;
        bool takes = filters.empty() || std::any_of(filters.begin(), filters.end(), [id](auto &f) {
                         return (id & f.second) == (f.first & f.second);
                     });
        if (takes) list.push_back(index);
    }
    takers_known_[id] = true;
    return list;
}

const std::vector<uint32_t> *CanBus::receivers(const CanFrame &frame) {
    const auto &all = takers(frame.id);
    bool sender_too = std::binary_search(all.begin(), all.end(), sender_);
    if (!sender_too && live_ == nodes_.size() && youngest_ <= begin_) return &all;
    some_takers_.clear();
    for (uint32_t node : all)
        if (node != sender_ && lives(node) && nodes_[node].since <= begin_)
            some_takers_.push_back(node);
    return &some_takers_;
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

/// All but the sender have received one more frame without an error.
void CanBus::count_receptions(uint32_t sender) {
    // As controllers do that were error passive: far enough below the limit to be active again.
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

/// A live node is one no longer; what it wanted to send is lost.
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

/// The bus is recessive until `until`; each 11 bits of it bring bus-off nodes nearer to the end.
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
