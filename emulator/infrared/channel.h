/// Interface of the infrared channels: what the simulation's loop needs of a medium.
///
/// In a world step the loop calls run(), then for each robot that is due lookahead(), then for each
/// run_robot(), then end_step(). The members of a team call lookahead() and run_robot(), each for
/// the robots of its share. A channel owns everything between the begin of a frame at one station
/// and its reception at others; what it cannot know of a station it asks its kind for
/// (infrared/station.h).
#ifndef KILOTWIN_INFRARED_CHANNEL_H
#define KILOTWIN_INFRARED_CHANNEL_H

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/chance.h"
#include "base/clock.h"
#include "base/prefetch.h"
#include "base/team.h"
#include "physics/bodies.h"
#include "physics/region.h"
#include "robots/robot.h"

namespace kilotwin {

class Stations;

/// Frames of one robot.
struct FrameCounts {
    uint32_t sent = 0, received = 0;
};

/// Fates of frames, over all robots.
struct ChannelCounts {
    uint64_t sent = 0, received = 0;  ///< received: at a robot
    uint64_t wrong_crc = 0;           ///< sent, but no robot takes them
    uint64_t attempts_failed = 0;     ///< not sent: channel found busy
    uint64_t collided = 0;            ///< lost at a receiver to another frame
    uint64_t deaf = 0;                ///< lost at a receiver that was sending itself
    uint64_t lost = 0;                ///< lost at a receiver by chance
    uint64_t above_sent = 0;          ///< by an overhead controller; in none of those before
    uint64_t above_received = 0;      ///< of these, at robots
    uint64_t above_reached = 0;       ///< robots that their light fell on, received or not

    ChannelCounts &operator+=(const ChannelCounts &more);
};

/// Shared by a channel and the simulation; all of it must live on.
struct ChannelContext {
    const Chance &chance;
    Swarm<Robot> &robots;
    Bodies &bodies;
    Team &team;      ///< that shares the loops over robots
    Cycles step;     ///< length of a world step
    bool run_ahead;  ///< false: robots are executed tick by tick
    /// The region that each overhead controller covers; empty: there is one, over all robots.
    const std::vector<Region> &overhead;
    /// The trail of frames that are received; null: none is kept.
    const std::unique_ptr<Trail> &trail;
};

class Channel {
  public:
    explicit Channel(const ChannelContext &context);
    virtual ~Channel() = default;
    Channel(const Channel &) = delete;
    Channel &operator=(const Channel &) = delete;

    /// Adds a kind of stations that execute by themselves. Earlier ones are executed first.
    void add(Stations &stations);

    /// Robots have been executed up to `now`, when stepping begins: executes the other stations up
    /// to there.
    virtual void boot(Cycles now);

    /// The host sends nothing before `until`.
    void host_silent_until(Cycles until);

    /// Lists of neighbours were made anew.
    virtual void lists_changed() {}

    /// A message from outside the channel reaches a robot at `at`: it may be ordered to send.
    virtual void order(uint32_t robot, Cycles at) {
        next_begin_[robot] = std::min(next_begin_[robot], at);
    }

    /// A robot is about to fail, between two steps; has failed: it may be deaf or mute now.
    virtual void settle(uint32_t /*robot*/) {}
    virtual void failed(uint32_t /*robot*/) {}

    /// A frame of an overhead controller begins at `at`, not before the current step: light on all
    /// robots that it covers. It does not yield, and does not overlap its own frames.
    virtual void shine_from_above(const message_t &message, Cycles at, uint32_t controller) = 0;

    /// When the next of these frames may first matter to a robot; NEVER without one.
    virtual Cycles next_from_above() const = 0;

    /// When a frame may first matter to a robot that is known to come, from above or of a station
    /// that is no robot. No robot is to be run beyond the begin of that step.
    Cycles next_light() const;

    /// Executes what needs the order of time among all stations: everything from `begin` to before
    /// `end`, the current step. No robot is run beyond `limit`.
    virtual void run(Cycles begin, Cycles end, Cycles limit) = 0;

    /// Whether run() executes robots, up to what needs the order of time.
    virtual bool executes_robots() const { return false; }

    /// Lookahead: until when nothing can reach a robot for certain, at most `limit`. A robot that
    /// cannot begin a frame, or cannot come into reach before, reaches none. Where it is before
    /// `useful` it may be given as any moment before that. Time O(neighbours), less in a crowd.
    virtual Cycles lookahead(uint32_t robot, Cycles useful, Cycles limit) const = 0;

    /// Executes a robot up to `until`, the end of the current step or lookahead(). Changes only
    /// what is the robot's, or its share's.
    virtual void run_robot(uint32_t robot, Cycles until) = 0;

    /// All robots have been executed up to the end of the current step, or farther.
    virtual void end_step() = 0;

    /// Bring into the cache what executing a robot needs, and its neighbours' lookahead.
    virtual void prefetch(uint32_t /*robot*/) const {}
    void prefetch_next_begin(uint32_t robot) const { prefetch_line(&next_begin_[robot]); }
    /// The same for lookahead(), of robots that are looked at in some turns: `latest` last.
    void prefetch_lookahead(uint32_t soon, uint32_t later, uint32_t latest) const {
        const Neighbours &lists = context_.bodies.lists();
        lists.prefetch_place(latest);
        lists.prefetch(later);
        for (uint32_t other : lists.of(soon)) {
            prefetch_next_begin(other);
            context_.bodies.prefetch_place(other);
        }
    }

    const ChannelCounts &counts() const { return counts_; }

    /// The trail of frames that are received; null: none is kept.
    Trail *trail() const { return context_.trail.get(); }

    /// By robot.
    virtual std::vector<FrameCounts> frames() const = 0;

    /// Whether the light of an overhead controller falls on a robot where it is.
    bool is_covered(uint32_t robot, uint32_t controller) const {
        const auto &regions = context_.overhead;
        return regions.empty() || regions[controller].contains(context_.bodies.position(robot));
    }
    /// How many there are, one at least.
    uint32_t controllers() const {
        return std::max(1u, static_cast<uint32_t>(context_.overhead.size()));
    }

  protected:
    void begin_step(Cycles begin, Cycles end);

    /// When light of another robot may first fall on `robot`, at most `limit`: not before the other
    /// may begin a frame (`begin_of`), nor before it can be within `range_of`, in m. Two robots
    /// approach each other by twice the speed of the fastest. With many neighbours, now_ as soon as
    /// one shows that it is before `useful`.
    template <typename Range, typename Begin>
    Cycles first_light(uint32_t robot, Cycles useful, Cycles limit, Range range_of,
                       Begin begin_of) const {
        constexpr ptrdiff_t FEW = 4;
        const Bodies &bodies = context_.bodies;
        const double s_per_m = 1 / (2 * bodies.fastest_m_s());
        const Eigen::Vector2d here = bodies.position(robot);
        const auto list = bodies.lists().of(robot);
        auto look_at = [&](uint32_t other) {
            const double way_m = (bodies.position(other) - here).norm() - range_of(other);
            const Cycles in_reach = now_ + whole_steps(way_m * s_per_m, context_.step);
            limit = std::min(limit, std::max(begin_of(other), in_reach));
        };
        const uint32_t *other = list.begin();
        // Without a branch, which could not be predicted: sparse swarms have no more neighbours.
        for (const uint32_t *few = other + std::min(FEW, list.end() - other); other != few; other++)
            look_at(*other);
        for (; other != list.end(); other++) {
            if (limit < useful) return now_;
            if (begin_of(*other) < limit) look_at(*other);
        }
        return limit;
    }

    ChannelContext context_;
    std::vector<Stations *> others_;  ///< kinds that execute by themselves
    bool has_lookahead_ = true;       ///< all of these have
    Swarm<Cycles> next_begin_;  ///< by robot: the earliest moment at which it may begin a frame
    Cycles now_ = 0, end_ = 0;  ///< of the current step
    ChannelCounts counts_;
};

}  // namespace kilotwin

#endif
