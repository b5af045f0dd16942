/// The lossless channel of the foot-bots: every robot in range (and, if asked for, in sight)
/// receives every frame.
///
/// A frame that begins within a world step is received at its end, but not before the next step
/// begins: so all robots can be executed through a step one after the other. Receivers are found as
/// robots stand at the begin of the step; both gains of a reception are the distance in mm. A
/// sender that stands keeps its receivers until one of those around it has moved.
#ifndef KILOTWIN_INFRARED_IDEAL_CHANNEL_H
#define KILOTWIN_INFRARED_IDEAL_CHANNEL_H

#include <deque>
#include <vector>

#include "base/memory.h"
#include "base/message_crc.h"
#include "base/prefetch.h"
#include "base/selection.h"
#include "infrared/channel.h"
#include "infrared/planned_frames.h"
#include "infrared/receivers_in_range.h"

namespace kilotwin {

/// One per run with the medium `ideal`.
class IdealChannel final : public Channel {
  public:
    struct Settings {
        double range_m;      ///< centre to centre
        bool line_of_sight;  ///< robots in between, with `radius_m`, hide others
        double radius_m;
    };

    IdealChannel(const Settings &settings, const ChannelContext &context);

    void boot(Cycles now) override;
    void lists_changed() override;
    /// Received by all robots that it covers when it ends, as their own frames are, also while
    /// another controller's is on air. Dropped if its CRC is wrong.
    void shine_from_above(const message_t &message, Cycles at, uint32_t controller) override;
    Cycles next_from_above() const override;
    void run(Cycles begin, Cycles end, Cycles limit) override;
    Cycles lookahead(uint32_t robot, Cycles useful, Cycles limit) const override;
    void run_robot(uint32_t index, Cycles until) override;

    /// Other stations are executed through the step; then its frames, in order of time, reach their
    /// receivers. Time O(frames log frames + receivers).
    void end_step() override;
    std::vector<FrameCounts> frames() const override {
        return {frames_of_.begin(), frames_of_.end()};
    }

    // --- For cells of a grid, beside this channel ---

    /// When a frame that begins at `at`, in the current step, is received.
    Cycles received_at(Cycles at) const { return std::max(at + FRAME_CYCLES, end_); }
    /// Where robots are.
    const Bodies &bodies() const { return context_.bodies; }

    /// The frame of a cell or a beacon reaches a robot.
    void deliver(uint32_t robot, Trail::Station from, Cycles begin, const message_t &message,
                 int16_t distance_mm);

  private:
    /// A robot as sender: half a line of the cache.
    struct alignas(32) Sender {
        Cycles next_request = 0;      ///< the earliest begin of a frame after the planned ones
        Cycles receivers_at = NEVER;  ///< when the kept receivers were found; NEVER: do not hold
        CheckedMessage message;       ///< the last one
        uint8_t planned = 0;          ///< so many of its frames are in frames_
    };
    static_assert(sizeof(Sender) == sizeof(CacheLine) / 2);

    /// A frame of an overhead controller, and when it ends.
    struct FromAbove {
        Cycles at;
        message_t message;
        uint32_t controller;
    };

    /// A frame on its way to a robot.
    struct Delivery {
        const Emission *emission;
        Receiver receiver;
    };
    /// Frames of a share's senders in a step, whose receivers are of any share.
    struct alignas(64) Share {
        StepSorter<PlannedFrame> sorter;
        ChannelCounts counts;                       ///< of this step
        std::vector<std::vector<Delivery>> on_way;  ///< by the receivers' share, by sender
        StepSorter<Delivery> arriving_sorter;
    };

    void plan_frames(uint32_t robot);
    void prefetch_after(const std::vector<PlannedFrame> &frames, size_t i) const;
    void end_step_in_order();  ///< all frames of the step, in order of time
    void end_step_by_place();
    std::vector<PlannedFrame> &frames_by_sender(uint32_t share);
    void deliver_to(uint32_t number);
    template <typename T, typename RobotOf, typename ThenOf>
    void sort_by_robot(StepSorter<T> &sorter, std::vector<T> &items, uint32_t share,
                       RobotOf robot_of, ThenOf then_of) const;
    template <typename Deliver>
    void send_all(const std::vector<PlannedFrame> &frames, uint32_t share, Deliver deliver);
    /// Finds the receivers, if its CRC is right.
    template <typename Deliver>
    void send(const Emission &emission, uint32_t share, Deliver deliver);
    void deliver(const Emission &emission, const Receiver &receiver, ChannelCounts &counts);
    const std::vector<Receiver> &receivers_of(uint32_t robot, uint32_t share);
    bool receivers_hold(uint32_t robot) const;

    double range_m_;
    Swarm<Sender> senders_;              ///< by robot
    Swarm<FrameCounts> frames_of_;       ///< by robot; a frame counts when it begins
    ReceiversInRange in_range_;          ///< finds and keeps receivers
    std::vector<PlannedFrames> frames_;  ///< sent, not yet received; by the senders' share
    std::vector<Share> shares_;
    std::deque<FromAbove> from_above_;  ///< frames that end later, in order of time
};

}  // namespace kilotwin

#endif
