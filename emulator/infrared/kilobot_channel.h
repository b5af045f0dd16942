/// The Kilobots' infrared: 30 kbit/s, half duplex, carrier sense, collisions, loss (hardware.md
/// 1.6).
///
/// Each receiver has its own set of audible frames, so hidden senders collide. A frame lasts 4.371
/// ms from the tick at which its sender asks its program. A robot that receives does not ask its
/// program. An attempt to send listens between its start pulse and the leader's stop pulse; light
/// seen then makes it fail, and the robot tries again within a tick. No capture: any light of
/// another frame spoils a frame at that receiver. Everything is taken in order of time, station by
/// station; members of a team do so side by side where robots cannot reach one another
/// (infrared/lanes.h).
///
/// Robots on boards see each pulse, and theirs are taken as they come: the first puts a frame on
/// air, and what it says is known when the last has come (avr/boards/board_stations.h).
///
/// The cells of a Kilogrid are stations too (hardware.md 3.4): robots near a cell receive its
/// frames, and a module receives from robots near the one cell that it listens to. A module listens
/// before it sends, is deaf while it sends, and its cells do not receive one another
/// (grid/cell_stations.h). So are beacons in objects (infrared/beacons.h), and overhead
/// controllers, which do not listen (infrared/light_from_above.h).
#ifndef KILOTWIN_INFRARED_KILOBOT_CHANNEL_H
#define KILOTWIN_INFRARED_KILOBOT_CHANNEL_H

#include <vector>

#include "infrared/carrier_sense.h"
#include "infrared/channel.h"
#include "infrared/frame_ends.h"
#include "infrared/frames_in_flight.h"
#include "infrared/guest_robots.h"
#include "infrared/lanes.h"
#include "infrared/light_from_above.h"
#include "infrared/robot_receiver.h"
#include "infrared/station.h"

namespace kilotwin {

/// One per run with the medium `kilobot`.
class KilobotChannel final : public Channel {
  public:
    /// Each mechanism can be switched off by itself.
    struct Settings : RobotReceiver::Settings {
        double range_m;       ///< of a mean sender, centre to centre
        double range_spread;  ///< sd over senders, share of the range
        bool carrier_sense;   ///< an attempt fails if light is seen in its window
        bool collisions;      ///< frames that overlap at a receiver are lost there
        bool half_duplex;     ///< a robot that sends receives nothing
        bool held_busy;       ///< light that never goes out: no attempt succeeds
    };

    /// Robots are guests but for those that assign() gives another kind; `others` more stations
    /// follow: beacons and cells. `runs_past_requests`, `ran_ahead`: see GuestRobots.
    KilobotChannel(const Settings &settings, const ChannelContext &context, uint32_t others,
                   bool runs_past_requests, GuestRobots::RanAhead ran_ahead);

    /// The farthest at which any robot is received, m.
    static double reach_m(const Settings &settings);

    /// Stations `first` to `first + count` - 1 are of this kind. Before boot(). Throws
    /// std::length_error where there are more kinds than Station::kind can number.
    void assign(Stations &kind, uint32_t first, uint32_t count);

    void boot(Cycles now) override;
    void settle(uint32_t robot) override { guests_.settle(robot); }
    void failed(uint32_t robot) override;
    void shine_from_above(const message_t &message, Cycles at, uint32_t controller) override {
        above_.add(message, at, controller);
    }
    Cycles next_from_above() const override { return above_.next(); }
    void lists_changed() override;
    void run(Cycles begin, Cycles end, Cycles limit) override;
    bool executes_robots() const override { return true; }
    Cycles lookahead(uint32_t robot, Cycles useful, Cycles limit) const override;
    void run_robot(uint32_t robot, Cycles until) override { guests_.run_robot(robot, until); }
    void end_step() override {}
    void prefetch(uint32_t robot) const override { in_flight_.prefetch(robot); }
    std::vector<FrameCounts> frames() const override;

    // --- For the kinds of stations ---

    // Shared by kinds: settings, receivers, windows, frames, counts.
    const Settings &settings() const { return settings_; }
    const RobotReceiver &receiver() const { return receiver_; }
    const CarrierSense &carrier_sense() const { return carrier_sense_; }
    FramesInFlight &in_flight() { return in_flight_; }
    const FramesInFlight &in_flight() const { return in_flight_; }
    const Lanes &lanes() const { return lanes_; }
    ChannelCounts &tally() { return counts_; }
    uint32_t robots() const { return static_cast<uint32_t>(context_.robots.size()); }
    Cycles now() const { return now_; }      ///< begin of the current step
    Cycles end() const { return end_; }      ///< of the current step
    Cycles limit() const { return limit_; }  ///< no robot is run beyond
    /// The earliest moment at which a robot may begin a frame. Its kind keeps it up to date.
    Cycles &next_begin(uint32_t robot) { return next_begin_[robot]; }
    Cycles next_begin(uint32_t robot) const { return next_begin_[robot]; }
    /// How far a robot is received: drawn once for the run.
    double robot_range_m(uint32_t robot) const { return ranges_m_[robot]; }
    void prefetch_range(uint32_t robot) const { prefetch_line(&ranges_m_[robot]); }

    /// Whether all stations are robots as guests: all light is theirs, or comes from above.
    bool has_guests_only() const { return others_.empty(); }

    /// Whether any kind may begin a frame near `robot` until `until`, other robots left aside.
    bool others_begin_near(uint32_t robot, Cycles until) const;

    /// The light of a frame begins at `sender` and reaches what is in range. What becomes of it is
    /// up to the caller: sense(), complete_later() or end_frame(), give_up().
    Frame &begin_light(uint32_t sender, Cycles at, const message_t &message);

    /// The same with the pulses of a sender that does not pass on its own; then carrier sense
    /// decides, unless it is `granted` that this finds the channel free.
    void begin_frame(uint32_t sender, Cycles at, const message_t &message, bool granted);

    /// Light of a frame reaches a robot, or all robots and others in range of a robot.
    void shine_on_robot(Frame &frame, uint32_t robot, double distance_m);
    void shine_around_robot(Frame &frame);

    /// The carrier-sense window of a frame is not over: sensed() of its kind will say what it
    /// found.
    void sense(const Frame &frame);

    /// A frame goes on to its end, where it is received.
    void complete_later(const Frame &frame);

    void end_frame(uint32_t sender);  ///< now: all that it reached receive it
    void give_up(uint32_t sender);    ///< takes it off the air

    // The calls of the same names, to all kinds but robots as guests.
    void hold_receivers(const Frame &frame, Cycles begin, Cycles end);
    void first_pulse(uint32_t sender, Cycles at);
    void other_pulses(uint32_t sender, Cycles at, const message_t &message);

  private:
    /// Ends to come in a lane.
    struct alignas(64) LaneEnds {
        Ends windows;  ///< of attempts whose carrier sense is not over
        Ends frames;   ///< of frames that go on to their end
    };

    /// The object that speaks for a station.
    Stations &kind_of(uint32_t station) { return *kinds_[in_flight_.station(station).kind]; }
    bool cut();
    bool is_far_light_on() const;
    void change_lanes();
    void run_lane(uint32_t lane);
    LaneEnds &ends_of(uint32_t sender) { return ends_[lanes_.of(sender)]; }
    bool run_others(Cycles next);
    void end_window(Ends &window_ends);
    /// Brings into the cache what the ends of frames some turns later need: between its begin and
    /// its end a frame leaves the cache again where many are on air. For large swarms only.
    void prefetch_frame_ends(const Ends &ends);

    Settings settings_;
    RobotReceiver receiver_;
    Lanes lanes_;
    FramesInFlight in_flight_;
    CarrierSense carrier_sense_;
    std::vector<Stations *> kinds_;  ///< by FramesInFlight::Station::kind
    GuestRobots guests_;
    LightFromAbove above_;
    Swarm<float> ranges_m_;       ///< of robots
    std::vector<LaneEnds> ends_;  ///< by lane
    Cycles limit_ = 0;            ///< of the current step
    bool has_new_lists_ = true;   ///< since the last step that was cut
};

}  // namespace kilotwin

#endif
