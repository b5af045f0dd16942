/// One CAN bus of 250 kbit/s: arbitration, timing and faults of its frames (ISO 11898-1).
///
/// Modelled: arbitration by identifier, the exact length of each frame with its stuff bits, the
/// acknowledgement, error frames, both error counters with error active, error passive and bus-off,
/// automatic retransmission, recovery after 128 times 11 recessive bits. A node sends its frames in
/// the order in which they were queued; one takes part in the arbitration at a frame's begin if it
/// was queued by then.
///
/// Not modelled: two nodes that send the same identifier at once. On the wire both go on until
/// their data differ, and then destroy each other's frames; here the lower node index goes first.
/// The Kilogrid's identifiers to the host hold the sender's address, so it does not happen there.
///
/// Times are cycles of 125 ns since power-up of the grid, and never go back: the owner of the bus
/// calls run(), then queue() and the faults for moments from there on. An idle bus costs nothing. A
/// frame costs O(log n) for n nodes, and O(n) after an error, which every node counts.
#ifndef KILOTWIN_GRID_CAN_BUS_H
#define KILOTWIN_GRID_CAN_BUS_H

#include <string>
#include <utility>
#include <vector>

#include "base/can_frame.h"
#include "base/chance.h"
#include "base/clock.h"
#include "dimensions.h"
#include "grid/can_coding.h"

namespace kilotwin {

constexpr Cycles CAN_BIT_CYCLES = CYCLES_PER_SECOND / KILOGRID_CAN_BIT_RATE;  ///< 4 us
/// An error frame: error flag, the other nodes' flags behind it, delimiter.
constexpr Cycles CAN_ERROR_FRAME_BITS = 6 + 6 + 8;
constexpr Cycles CAN_INTERMISSION_BITS = 3;
/// Suspend transmission: an error passive node that has sent waits so much longer than others.
constexpr Cycles CAN_SUSPEND_BITS = 8;

class CanBus {
  public:
    struct Settings {
        double error_share;  ///< share of attempts to send that a disturbance destroys, 0 to 1
    };

    struct Node {
        std::string name;
        /// Acceptance filters: a frame passes whose (frame id & mask) == (id & mask); empty: every
        /// frame. Each node acknowledges every frame, accepted or not.
        std::vector<std::pair<uint16_t, uint16_t>> filters;  ///< id, mask
        size_t tx_queue = 16;  ///< places for frames to send, the one on the wire included
    };

    enum class State : uint8_t { ERROR_ACTIVE, ERROR_PASSIVE, BUS_OFF, DEAD };

    /// A frame that has reached its end: sent and received at the same moment.
    struct Delivery {
        Cycles begin, at;  ///< start of frame; end of its last bit
        uint32_t sender;
        CanFrame frame;
        /// Nodes that accept it, ascending, without the sender; valid until the next call.
        const std::vector<uint32_t> *receivers;
    };

    /// Since the bus was made. Nothing is reset, nothing saturates.
    struct Counts {
        uint64_t frames = 0;            ///< that reached their end
        Cycles busy = 0;                ///< with frames, error frames and intermissions
        uint64_t error_frames = 0;      ///< attempts destroyed, for any reason ...
        uint64_t not_acknowledged = 0;  ///< ... of these: no other node was alive
        uint64_t went_bus_off = 0;      ///< nodes that did, by errors or by bus_off()
        /// Frames that never reached their end.
        uint64_t lost_queue_full = 0;  ///< refused by queue()
        uint64_t lost_bus_off = 0;     ///< refused, or waiting when their node went bus-off
        uint64_t lost_dead = 0;        ///< refused, or waiting when their node died
    };

    /// `bus` is the bus's index in the grid, which keys its random draws. `chance` is copied.
    CanBus(const Settings &settings, const Chance &chance, uint32_t bus);

    /// Adds a node, error active, and returns its index. Only while nothing has been sent.
    uint32_t attach(const Node &node);

    /// Queues `frame` at `node`, to be sent from `at` on; `at` is not before the end of the last
    /// run(). False, and counted as lost, if the queue is full or the node bus-off or dead.
    bool queue(uint32_t index, Cycles at, const CanFrame &frame);

    /// The earliest moment at which a frame can reach its end, with what is queued now; NEVER if
    /// none waits or no second node lives to acknowledge it. O(1).
    Cycles next() const;

    /// Runs up to `until`, exclusive, and calls `on_delivery(const Delivery &)` for every frame
    /// that ends, in order of time. The callback may queue frames from the delivery's time on.
    template <typename OnDelivery> void run(Cycles until, OnDelivery &&on_delivery) {
        while (const Delivery *delivery = step(until)) on_delivery(*delivery);
    }

    // Faults. The bus has been run up to `at`.

    /// Cuts the node's power: its frame on the wire breaks off, its queue is lost.
    void kill(uint32_t node, Cycles at);
    /// Takes the node bus-off, as 32 transmit errors in a row do; its queue is lost. It recovers by
    /// itself, after 128 sequences of 11 recessive bits; if `held`, it does so only once recover()
    /// was called. No effect on a dead node.
    void bus_off(uint32_t node, Cycles at, bool held = false);
    /// Powers a dead node again, error active with counters of 0; a held one begins its recovery.
    void recover(uint32_t node, Cycles at);

    /// Nodes attached, dead ones included.
    size_t nodes() const { return nodes_.size(); }
    const std::string &name(uint32_t node) const { return nodes_[node].name; }
    State state(uint32_t node) const { return nodes_[node].state; }
    uint32_t transmit_errors(uint32_t node) const { return nodes_[node].transmit_errors; }
    uint32_t receive_errors(uint32_t node) const { return nodes_[node].receive_errors; }
    /// Frames queued at `node`, the one on the wire included.
    size_t queued(uint32_t node) const { return nodes_[node].size; }
    const Counts &counts() const { return counts_; }
    /// Share of the time from 0 to `now` in which the bus was not idle, 0 to 1.
    double load(Cycles now) const;

  private:
    struct Queued {
        Cycles at;  ///< not before
        CanFrame frame;
        uint16_t bits;
    };
    struct NodeState {
        std::string name;
        State state = State::ERROR_ACTIVE;
        bool held = false;  ///< bus-off until recover() is called
        uint32_t transmit_errors = 0, receive_errors = 0;
        Cycles since = 0;  ///< on the bus since then: frames that began earlier pass it by
        /// Frames to send, a ring from `first` on; grows up to `most`.
        std::vector<Queued> ring;
        size_t first = 0, size = 0, most;
        std::vector<std::pair<uint16_t, uint16_t>> filters;
    };
    /// The first frame of a node's queue, as it takes part in the arbitration. In one of two heaps:
    /// in `ready_` if it may begin when the bus falls idle, in `waiting_` if later.
    struct Head {
        Cycles at;
        uint16_t id;
        uint32_t node;
    };
    enum class Outcome : uint8_t { ARRIVES, DISTURBED, NOT_ACKNOWLEDGED, BROKEN_OFF };
    /// A bus-off node on its way back.
    struct Recovery {
        uint32_t node;
        Cycles from;         ///< begin of the recessive bits not yet counted
        uint32_t remaining;  ///< of RECOVERY_SEQUENCES
    };

    /// The next frame that ends before `until`; null if there is none.
    const Delivery *step(Cycles until);
    bool begin_attempt(Cycles until);
    void settle_outcome();
    const Delivery *end_delivered();
    void end_failed();
    void free_bus(Cycles end, Cycles recessive_from);
    void add_head(uint32_t node, Cycles not_before);
    void remove_head(uint32_t node);
    void drop_queue(uint32_t index, uint64_t &lost);
    void leave(uint32_t index, State state, Cycles at, uint64_t &lost);
    void go_bus_off(uint32_t node, Cycles at);
    void revive(uint32_t node, Cycles at);
    void recover_until(Cycles until, bool gap_ends);
    void count_transmit_error(uint32_t index, uint32_t by);
    void count_receive_errors(uint32_t sender);
    void count_receptions(uint32_t sender);
    void update_state(uint32_t index);
    bool lives(uint32_t node) const { return nodes_[node].state <= State::ERROR_PASSIVE; }
    const std::vector<uint32_t> &accepting(uint16_t id);
    const std::vector<uint32_t> *receivers(const CanFrame &frame);
    Queued &head(uint32_t node) { return nodes_[node].ring[nodes_[node].first]; }
    const Queued &head(uint32_t node) const { return nodes_[node].ring[nodes_[node].first]; }

    double error_share_;
    Chance chance_;
    uint32_t bus_;
    std::vector<NodeState> nodes_;
    size_t live_ = 0;
    Cycles youngest_ = 0;  ///< the latest `since` of all nodes

    std::vector<Head> ready_;    ///< heap: lowest identifier, then lowest node
    std::vector<Head> waiting_;  ///< heap: earliest, then as in ready_
    Cycles free_at_ = 0;         ///< when the last intermission ends

    bool on_wire_ = false;
    uint32_t sender_ = 0;
    Cycles begin_ = 0, end_ = 0;
    Outcome outcome_ = Outcome::ARRIVES;
    uint64_t attempts_ = 0;  ///< with error_share: draws made
    Delivery delivery_{};

    std::vector<uint32_t> erring_;  ///< nodes whose receive error counter is not 0
    std::vector<Recovery> recoveries_;
    std::vector<std::vector<uint32_t>> accepting_;  ///< by identifier, filled on first use
    std::vector<bool> accepting_known_;
    std::vector<uint32_t>
        some_accepting_;  ///< of one delivery, if a node that accepts cannot receive
    Counts counts_;
};

}  // namespace kilotwin

#endif
