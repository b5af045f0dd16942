/// Frames in flight: which are on air, and at which receivers each can be received.
///
/// Each station has its own set of audible frames, so frames of senders that do not hear one
/// another meet at a receiver between them. Nothing here depends on what kind of station sends or
/// receives.
#ifndef KILOTWIN_INFRARED_FRAMES_IN_FLIGHT_H
#define KILOTWIN_INFRARED_FRAMES_IN_FLIGHT_H

#include <cstdint>
#include <mutex>
#include <vector>

#include "base/clock.h"
#include "base/few.h"
#include "base/memory.h"
#include "base/message_crc.h"
#include "base/prefetch.h"
#include "infrared/channel.h"

namespace kilotwin {

/// Fate of a frame at one receiver.
enum class Fate : uint8_t {
    CLEAR,      ///< it will be received
    COLLIDED,   ///< another frame overlaps it there
    DEAF,       ///< the receiver sends itself
    LOST,       ///< by chance, drawn when its light begins: at a chip, which sees each pulse
    ELSEWHERE,  ///< at a cell: its module listens to another cell
};

/// A receiver that a frame's light falls on.
struct Reached {
    uint32_t station;   ///< its number
    float distance_mm;  ///< centre to centre
    Fate fate;          ///< as far as is known
};

/// A frame in flight, or only the attempt at one: carrier sense may still end it.
struct Frame {
    Cycles begin;       ///< of the leader's start pulse
    double range_m;     ///< it is not received from farther away
    uint32_t sender;    ///< station
    uint32_t listener;  ///< station at whose receiver the sender listens before it sends
    bool granted;       ///< carrier sense is known to find the channel free
    bool has_orders;    ///< it may order a robot to run, and so to send: a module's, or from above
    uint64_t above;     ///< number of an overhead controller's frame, from 1; 0: it is none
    const CheckedMessage *message;  ///< of the sender; of a chip, known when the frame ends
    Few<Reached, 5> reached;        ///< receivers, in the order in which light reached them
};

/// One per Kilobot channel. Costs are those of the receivers in range of a frame, few.
class FramesInFlight {
  public:
    static constexpr uint32_t NONE = UINT32_MAX;
    using Indices = Few<uint32_t, 4>;  ///< of frames, see operator[]

    /// State of a station: one cache line.
    struct alignas(64) Station {
        Indices audible;            ///< frames whose light falls on it
        uint64_t draws = 0;         ///< so many numbers were drawn for what it receives
        FrameCounts counts;         ///< of a robot
        uint32_t frame = NONE;      ///< what it sends
        uint32_t arrival = NONE;    ///< the last that a robot has to get (guest_robots.h)
        uint16_t planned = 0;       ///< so many of its frames are planned
        uint8_t kind = 0;           ///< index of its Stations in the channel
        bool heeds_light = false;   ///< a robot that is told when light falls on it
        bool in_turn = false;       ///< a robot that is executed in its turn (guest_robots.h)
        bool is_tentative = false;  ///< a robot that is run tentatively (tentative_runs.h)
        bool is_deaf = false;       ///< a robot on which no light falls any more
        bool is_mute = false;       ///< one whose light reaches no receiver
    };

    /// No frame, and no light on any of so many stations, which have their events in so many lanes
    /// (infrared/lanes.h).
    explicit FramesInFlight(size_t stations, uint32_t lanes = 1);

    Station &station(uint32_t station) { return stations_[station]; }
    const Station &station(uint32_t station) const { return stations_[station]; }
    size_t stations() const { return stations_.size(); }

    /// The frame that `sender` sends; only while is_on_air().
    Frame &of(uint32_t sender) { return frames_[stations_[sender].frame]; }
    const Frame &operator[](uint32_t index) const { return frames_[index]; }

    /// Whether it sends a frame, or attempts to.
    bool is_on_air(uint32_t station) const { return stations_[station].frame != NONE; }

    /// Whether no light falls on a station.
    bool is_dark(uint32_t station) const { return stations_[station].audible.empty(); }

    /// The last message of a station; kept when its frame has ended.
    CheckedMessage &message(uint32_t station) { return messages_[station]; }

    /// A frame of `sender` begins at `at`, received by none so far. References to other frames do
    /// not outlive this call.
    Frame &put_on_air(uint32_t sender, Cycles at, double range_m, const message_t &message,
                      uint32_t lane = 0);

    /// The light of `frame` falls on a receiver.
    void reach(Frame &frame, const Reached &reached) {
        frame.reached.push_back(reached);
        stations_[reached.station].audible.push_back(stations_[frame.sender].frame);
    }

    /// Other light begins at `station`: the frames audible there collide.
    void spoil(uint32_t station);

    /// `station` begins to send: the frames audible there are not received.
    void deafen(uint32_t station);

    /// A frame has ended or was given up. It can be read until the next one begins.
    void take_off_air(const Frame &frame, uint32_t lane = 0);

    /// Between two steps: what lanes have no frame in can be used by any of them.
    void share_free();

    /// Brings the frame that `sender` sends into the cache, but for a long list of receivers. Reads
    /// the sender's record.
    void prefetch_frame(uint32_t sender) const {
        prefetch_bytes(&frames_[stations_[sender].frame], sizeof(Frame));
    }

    /// Brings a station's record, and its message, into the cache.
    void prefetch(uint32_t station) const { prefetch_line(&stations_[station]); }
    void prefetch_message(uint32_t station) const { prefetch_line(&messages_[station]); }

  private:
    /// Indices of frames_ to be used again by a lane.
    struct alignas(64) Free {
        std::vector<uint32_t> indices;
    };
    static constexpr size_t SOME = 16;  ///< so many frames a lane takes at once

    void fetch_free(std::vector<uint32_t> &free);

    Swarm<Station> stations_;
    Swarm<CheckedMessage> messages_;  ///< by station
    /// But for the free ones on air: few, so they stay cached. Lanes that work side by side have
    /// room for all that there may be: frames stay where they are.
    std::vector<Frame> frames_;
    std::vector<Free> free_;       ///< by lane
    std::vector<uint32_t> spare_;  ///< free, of no lane
    std::mutex fetching_;          ///< a lane adds to frames_ or takes of spare_
};

}  // namespace kilotwin

#endif
