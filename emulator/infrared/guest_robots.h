/// Robots as guests, on the Kilobots' channel: when their programs are asked for messages, how far
/// they are run ahead, and what they receive.
///
/// A robot is executed up to the moment of its transmit request, and past it if carrier sense is
/// known to find the channel free: then its frames are planned, and begin in their time. A robot
/// of which that is known when the step begins need not wait for its turn: members of a team
/// execute these first. Requests and planned frames of one step are kept in order of time, by each
/// lane (infrared/lanes.h); each costs O(neighbours).
///
/// A robot that has had nothing to say for some time is run on tentatively, for many steps, as if
/// no light reached it, and where light does reach it, it is brought back (tentative_runs.h). To
/// all others it is a robot that may begin a frame any time.
#ifndef KILOTWIN_INFRARED_GUEST_ROBOTS_H
#define KILOTWIN_INFRARED_GUEST_ROBOTS_H

#include <functional>
#include <utility>
#include <vector>

#include "base/prefetch.h"
#include "infrared/guest_events.h"
#include "infrared/planned_frames.h"
#include "infrared/robot_receiver.h"
#include "infrared/station.h"
#include "infrared/tentative_runs.h"

namespace kilotwin {

class KilobotChannel;

class GuestRobots final : public Stations {
  public:
    /// Called when a robot has been run beyond the current step, up to `until`.
    using RanAhead = std::function<void(uint32_t robot, Cycles until)>;

    /// With `runs_past_requests` a robot is run on past a request that is granted, as far as its
    /// lookahead says. Everything referred to must live on.
    GuestRobots(KilobotChannel &channel, const ChannelContext &context,
                const RobotReceiver &receiver, bool runs_past_requests, RanAhead ran_ahead);

    /// Executes the robots that need not wait for their turns in the current step. Time O(robots).
    void run_first();

    /// Robots that were given a request in an earlier step have their turns in this one. Before
    /// lanes are cut.
    void give_later_turns();

    /// Lanes were cut, or joined: such requests go to their lanes.
    void change_lanes();

    /// Collects the requests and planned frames of a lane in the current step; the joint one comes
    /// last.
    void begin_events(uint32_t lane);

    /// When the next of them is due; NEVER without one.
    Cycles next_event(uint32_t lane) const;

    /// Takes the next one: a planned frame begins, or a robot is executed through its request.
    void take_event(uint32_t lane);

    /// All requests of the current step have been taken.
    void end_requests();

    /// Executes a robot up to `until`; the channel has taken everything that may reach it before
    /// the end of the current step, and beyond nothing does.
    void run_robot(uint32_t robot, Cycles until);

    /// Until when a robot, which no light reaches before `until`, need not be executed in the order
    /// of time: it may send meanwhile if its carrier sense is over by then.
    Cycles alone_until(uint32_t robot, Cycles until) const;

    double range_m(uint32_t robot) const override;
    Cycles next_begin(uint32_t robot) const override;
    void settle(uint32_t robot);  ///< as Channel's
    void shine(Frame &frame) override;
    void sensed(const Frame &frame, bool busy) override;
    void gave_up(const Frame &frame) override;
    void sent(const Frame &frame) override;
    void light_begins(const Frame &frame, Reached &reached) override;
    void received(const Frame &frame, const Reached &reached) override;
    /// Its gains and its inbox.
    void prefetch(uint32_t robot) const override;

  private:
    static constexpr uint8_t KIND = 0;  ///< the channel assigns it first

    /// A frame that a robot has received, unless chance loses it there.
    struct Arrival {
        Cycles begin;  ///< of the frame
        double range_m;
        uint64_t draw;   ///< the robot's count of frames
        uint32_t robot;  ///< NONE: it has got this
        float distance_mm;
        message_t message;
        uint32_t before;  ///< the robot's last one before, in the same list; NONE: there is none

        bool is_handed_over() const { return robot == FramesInFlight::NONE; }
    };
    /// Robots of a share in this step (base/team.h), and events of its lane; the joint lane has one
    /// without robots, where there are several.
    struct alignas(64) Share {
        /// Those that may begin a frame.
        std::vector<uint32_t> senders;
        /// Those that need not wait for their turns, and up to when they are executed first.
        std::vector<std::pair<uint32_t, Cycles>> first;
        PlannedFrames planned;
        std::vector<PlannedFrame> joined;  ///< those of this step that the joint lane begins
        GuestEvents events;
        GuestEvent turn = {0, 0, 0};  ///< the event that was taken last
        std::vector<uint32_t> turns;  ///< robots that have turns in this step
        /// Frames that robots get when all requests have been taken: none of them is executed
        /// before. Robots that have their turns get theirs at once.
        std::vector<Arrival> arrivals;
        ChannelCounts counts;
    };

    void find_senders(Share &share, size_t begin, size_t end);
    Cycles run_first_until(uint32_t robot) const;
    void begin_event(Share &share, uint32_t robot);
    void hand_on_joined(uint32_t lane);
    void take_joined(Share &joint);
    void run_first(uint32_t index, Cycles until);
    void grant(Robot &robot, Cycles at, Cycles until) const;
    Share &lane_of(uint32_t robot);
    void schedule(const GuestEvent &event);
    void give_turn(uint32_t robot);
    void hand_over(const Arrival &arrival, ChannelCounts &counts);
    void hand_over_up_to(uint32_t last, Share &share);
    void hand_over_all(Share &share);
    /// Brings into the cache what the events of a lane some turns after the next one need. For
    /// large swarms only.
    void prefetch_events(Share &share);
    void prefetch_receiver(uint32_t robot) const;
    void prefetch_senders_after(const Share &share, size_t i) const;
    void prefetch_first_after(const Share &share, size_t i) const;
    bool is_in_range(uint32_t sender, uint32_t other) const;
    bool may_be_in_range(uint32_t sender, uint32_t other) const;
    void take_request(uint32_t index, Cycles at);
    bool may_run_tentatively(uint32_t index) const;
    bool run_tentatively(uint32_t index);
    Cycles end_tentative_run(uint32_t index);
    void bring_back(uint32_t index, const Frame &frame);
    bool is_channel_free(uint32_t index, Cycles at) const;
    Cycles request_of(uint32_t robot) const;
    void run_on(uint32_t index, Cycles until, Cycles requested_at = NEVER);
    void plan_frames(uint32_t index, Cycles requested_at);
    static Cycles next_request(const Robot &robot);
    /// Frames of a lane in this step.
    std::vector<PlannedFrame> &planned_in(Share &share);

    KilobotChannel &channel_;
    ChannelContext context_;
    const RobotReceiver &receiver_;
    bool runs_past_requests_;
    RanAhead ran_ahead_;
    std::vector<Share> shares_;      ///< by lane
    std::vector<GuestEvent> later_;  ///< requests that change lanes
    TentativeRuns tentative_;
};

}  // namespace kilotwin

#endif
