/// The robots' own infrared: 30 kbit/s, half duplex, carrier sense, collisions, loss (hardware.md
/// 1.6).
///
/// Each receiver has its own set of audible senders, so hidden senders collide. A frame lasts 4.371
/// ms from the tick at which its sender asks its program. Whoever receives is not asked. An attempt
/// listens between its start pulse and the leader's stop pulse; light seen then makes it fail, and
/// the robot tries again within a tick. No capture: any light of another frame spoils a frame at
/// that receiver. What robots do is taken in order of time, robot by robot.
///
/// Robots on boards see each pulse for themselves, and theirs are taken as they come: the first
/// puts a frame on air, and what it says is known when the last has come (avr/boards/boards.h).
///
/// The cells of a Kilogrid are stations too (hardware.md 3.4): robots near a cell hear its frames,
/// and a module hears robots near the one cell that it listens to. A module listens before it sends,
/// is deaf while it sends, and its cells do not hear one another.
#ifndef KILOTWIN_INFRARED_KILOBOT_MEDIUM_H
#define KILOTWIN_INFRARED_KILOBOT_MEDIUM_H

#include <Eigen/Core>
#include <functional>
#include <queue>
#include <vector>

#include "avr/boards/boards.h"
#include "base/chance.h"
#include "base/memory.h"
#include "base/message_crc.h"
#include "base/selection.h"
#include "grid/grid.h"
#include "guest/robot.h"
#include "infrared/planned_frames.h"
#include "physics/bodies.h"

namespace kilotwin {

/// A robot's part in what became of frames.
struct FrameCounts {
    uint32_t sent = 0, received = 0;
};

/// What became of frames.
struct MediumCounts {
    uint64_t sent = 0, received = 0;  ///< received: at a robot
    uint64_t wrong_crc = 0;           ///< sent, but nobody takes them
    uint64_t attempts_failed = 0;     ///< not sent: channel found busy
    uint64_t collided = 0;            ///< lost at a receiver to another frame
    uint64_t deaf = 0;                ///< lost at a receiver that was sending itself
    uint64_t lost = 0;                ///< lost at a receiver by chance
};

class KilobotMedium {
  public:
    /// Of each robot; what reached one with a board counts as received.
    std::vector<FrameCounts> by_robot() const;

    /// Each mechanism can be switched off by itself.
    struct Settings {
        double range_m = 0.10;
        double range_spread = 0.05;  ///< sd over senders, share of the range
        double loss = 0.02;          ///< share of frames lost near the sender ...
        double loss_at_range =
            0.20;  ///< ... and at the end of its range; grows with the distance's 4th power
        double gain_noise_lsb = 2;  ///< sd of each converter reading
        bool carrier_sense = true;
        bool collisions = true;
        bool half_duplex = true;
        bool held_busy = false;  ///< somebody's light never goes out: no attempt succeeds
    };

    /// Until when nothing reaches a robot for certain that the medium does not claim, and none of
    /// its surroundings change; not beyond a limit.
    using Undisturbed = std::function<Cycles(uint32_t robot, Cycles limit)>;
    /// Told of a robot that has lived beyond the current step, up to `until`.
    using LivedAhead = std::function<void(uint32_t robot, Cycles until)>;

    /// `speaks`: by robot, the earliest moment at which it may begin a frame; kept up to date here.
    /// `grid` and `boards` may be null.
    KilobotMedium(const Settings &settings, const Chance &chance, Swarm<Robot> &robots,
                  Bodies &bodies, std::vector<Cycles> &speaks, std::vector<Emission> &emissions,
                  MediumCounts &counts, Undisturbed undisturbed_until, LivedAhead lived_ahead,
                  Grid *grid, Boards *boards);

    /// The farthest that anybody can be heard.
    static double reach_m(const Settings &settings);

    /// Whether a robot cannot be left alone beyond the current step: it receives, it is in the
    /// middle of a transmission, or the channel is not free.
    bool claims(uint32_t robot) const {
        return settings_.held_busy || !stations_[robot].audible.empty() || on_air(robot);
    }

    /// How far a robot is heard.
    double range_m(uint32_t robot) const { return ranges_m_[robot]; }

    /// Brings what is asked of a robot into the cache.
    void prefetch(uint32_t robot) const { prefetch_line(&stations_[robot]); }

    /// Until when a robot that is not claimed can be left alone, if no light reaches it before
    /// `until`: it may send meanwhile, if it is done listening by then.
    Cycles alone_until(uint32_t robot, Cycles until) const;

    /// Takes all that begins or ends between `begin` and `end`, the current step, in order of time.
    /// Robots live up to the moments at which they may send, and none beyond `limit`.
    void run(Cycles begin, Cycles end, Cycles limit);

    /// Lets a robot live up to `until`; run() has gone through everything that may reach it before
    /// the current step's end, and beyond nothing does. What it sends later goes on air in its
    /// time.
    void live(uint32_t robot, Cycles until);

  private:
    // Stations are the robots, then the cells of the grid.
    enum class Fate : uint8_t {
        CLEAR,
        COLLIDED,
        DEAF,
        LOST,      ///< at a board: chance has decided beforehand
        ELSEWHERE  ///< of a cell: its module listens to another one
    };
    struct Heard {
        uint32_t station;
        float distance_mm;
        Fate fate;
    };
    /// One that is on air.
    struct Frame {
        Cycles begin;
        double range_m;     ///< nobody hears it from farther away
        uint32_t sender;    ///< station
        uint32_t listener;  ///< station at whose receiver the sender listens first
        bool granted;       ///< its sender did not have to listen first
        Few<Heard, 5> heard;
    };
    using Frames = Few<uint32_t, 4>;  ///< in frames_
    static constexpr uint32_t NONE = UINT32_MAX;
    /// One line of the cache.
    struct alignas(64) Station {
        Frames audible;
        uint64_t draws = 0;
        FrameCounts counts;
        uint32_t frame = NONE;  ///< in frames_: what it sends
        uint16_t planned = 0;   ///< so many of its frames are planned
    };
    /// In this order when at the same time.
    enum class What : uint8_t { FRAME_END, SENSE_END, BEGIN, ASK };
    struct Event {
        Cycles at;
        What what;
        uint32_t station;  ///< of a BEGIN instead: which of the planned frames
        bool operator>(const Event &other) const {
            if (at != other.at) return at > other.at;
            return what != other.what ? what > other.what : station > other.station;
        }
    };
    /// Events in order of time; most come in that order.
    class Queue {
      public:
        void push(const Event &event);
        void pop();
        bool empty() const { return events_.empty(); }
        const Event &front() const { return events_[first_]; }

      private:
        std::vector<Event> events_;  ///< from first_ on
        size_t first_ = 0;
    };
    /// What a module's one receiver is busy with.
    struct Receiver {
        Cycles sending_until = 0, receiving_until = 0;
        uint64_t draws = 0;
    };

    void find_asks(Cycles begin, Cycles end);
    void ask_later(const Event &event);
    Event next_event() const;
    void prefetch_asked(size_t next);
    uint32_t speaker(const Event &event);
    bool is_in_range(uint32_t sender, uint32_t other) const;
    void take(const Event &event);
    void take_emissions(uint32_t robot);
    static Cycles next_ask(const Robot &robot);
    std::vector<PlannedFrame> &planned_at(Cycles at) { return planned_.at(at, step_); }
    void ask(uint32_t robot, Cycles at);
    void go_on(uint32_t robot, Cycles until);
    bool has_channel(uint32_t robot, Cycles at) const;
    void begin_frame(uint32_t sender, Cycles at, const message_t &message, bool granted);
    Frame &begin_light(uint32_t sender, Cycles at, const message_t &message);
    void begin_cell_frame(uint32_t module);
    Frame &begin_cell_light(uint32_t station, Cycles at, const message_t &message);
    Frame &put_on_air(uint32_t sender, Cycles at, const message_t &message);
    void shine_on_robot(Frame &frame, uint32_t robot, double distance_m);
    void shine_on_board(const Frame &frame, Heard &heard);
    void shine_on_board_cell(Frame &frame, uint32_t cell, double distance_m);
    void take_flash(const Boards::Flash &flash);
    bool is_lost(const Frame &frame, const Heard &heard, uint64_t draw) const;
    distance_measurement_t measure(const Heard &heard, uint64_t draw) const;
    void spoil(const Frames &frames, uint32_t station);
    void shine_on_cells(Frame &frame, const Eigen::Vector2d &from);
    bool nobody_interferes(uint32_t cell, Cycles at) const;
    void cell_has_channel(Frame &frame);
    void hold_receivers(const Frame &frame, Cycles begin, Cycles end);
    void end_sensing(uint32_t sender);
    void end_frame(uint32_t sender);
    void leave_air(const Frame &frame);
    bool receives(uint32_t robot, Cycles at) const;
    bool finds_busy(const Frame &frame) const;
    void deliver(const Frame &frame, const Heard &heard);
    void deliver_to_cell(const Frame &frame, const Heard &heard);
    bool on_air(uint32_t sender) const { return stations_[sender].frame != NONE; }
    Frame &frame_of(uint32_t sender) { return frames_[stations_[sender].frame]; }
    void reach(Frame &frame, const Heard &heard) {
        frame.heard.push_back(heard);
        stations_[heard.station].audible.push_back(stations_[frame.sender].frame);
    }
    bool on_board(uint32_t robot) const { return boards_ != nullptr && robots_[robot].on_board(); }
    bool is_cell(uint32_t station) const { return station >= robots_.size(); }
    uint32_t station_of(uint32_t cell) const {
        return static_cast<uint32_t>(robots_.size()) + cell;
    }
    uint32_t cell_of(uint32_t station) const {
        return station - static_cast<uint32_t>(robots_.size());
    }
    uint32_t module_of(uint32_t station) const { return GridLayout::module_of(cell_of(station)); }

    Settings settings_;
    const Chance &chance_;
    Swarm<Robot> &robots_;
    Bodies &bodies_;
    std::vector<Cycles> &speaks_;
    std::vector<Emission> &emissions_;  ///< what robots send that were granted the channel
    MediumCounts &counts_;
    Undisturbed undisturbed_until_;
    LivedAhead lived_ahead_;
    Grid *grid_;
    Boards *boards_;  ///< null: there are none
    Swarm<Station> stations_;
    std::vector<CheckedMessage> said_;  ///< by station: last
    std::vector<float> ranges_m_;       ///< of robots
    std::vector<Frame> frames_;         ///< on air, but for the free ones: few, so they stay cached
    std::vector<uint32_t> free_frames_;
    std::vector<Receiver> receivers_;  ///< by module
    InfraredGains cell_gains_;
    PlannedFrames planned_;
    std::vector<uint32_t> speakers_;  ///< who may begin a frame within this step
    std::vector<Event> asks_;         ///< of this step, those from next_ask_ on to come
    StepSorter<Event> ask_sorter_;
    size_t next_ask_ = 0;
    std::priority_queue<Event, std::vector<Event>, std::greater<>> other_asks_;
    Queue sense_ends_, frame_ends_;
    Cycles step_ = 1, end_ = 0, limit_ = 0;
    Cycles asked_at_ = NEVER;  ///< the moment that a robot is run through
};

}  // namespace kilotwin

#endif
