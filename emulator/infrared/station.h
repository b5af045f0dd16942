/// Interface of the stations: what a channel needs of those that send and receive on it.
///
/// A Stations object speaks for all stations of one kind: robots as guests, robots on boards, cells
/// of a grid. Stations are numbered through: the robots first, whatever their kind, then the cells.
/// The channel decides what light does on the air (range, carrier sense, collisions, half duplex);
/// a kind decides which of its own are in reach, and what its receivers make of a frame. A new kind
/// of station is a new class here; no channel tests what kind one is.
///
/// Kinds are called per frame, receiver or event, not per tick. Calls that a kind has no use for
/// have empty defaults. All times are the world's, in cycles.
#ifndef KILOTWIN_INFRARED_STATION_H
#define KILOTWIN_INFRARED_STATION_H

#include <Eigen/Core>
#include <cstdint>

#include "base/clock.h"
#include "infrared/frames_in_flight.h"

namespace kilotwin {

class Stations {
  public:
    Stations() = default;
    virtual ~Stations() = default;
    Stations(const Stations &) = delete;
    Stations &operator=(const Stations &) = delete;

    // --- Time: for kinds that execute by themselves; the loop executes robots that are guests. ---

    /// Executes everything before `until`, while there is no light anywhere. Called once.
    virtual void boot(Cycles /*until*/) {}

    /// The host sends nothing before `until`: at least so long kinds can run ahead of it.
    virtual void host_silent_until(Cycles /*until*/) {}

    /// A world step begins at `now`, with all robots at their places.
    virtual void begin_step(Cycles /*now*/) {}

    /// Whether it is known when its stations may begin a frame (next_begin(), begins_near()). Where
    /// there is one kind that does not know, no robot is run ahead.
    virtual bool has_lookahead() const { return true; }

    /// When one of its stations, which are no robots, may next begin a frame; NEVER if
    /// has_lookahead() is false. No robot is run beyond the begin of that step.
    virtual Cycles next_light() const { return NEVER; }

    /// The moment beyond which no other kind may be executed before this one has been.
    virtual Cycles next_turn() const { return NEVER; }

    /// Executes what is before `next`, but not much beyond `turn`, up to which all other kinds have
    /// been executed. Stops and returns true where it has put light on the channel or taken it off.
    virtual bool run(Cycles /*turn*/, Cycles /*next*/) { return false; }

    // --- Sending ---

    /// How far a station is received, in m.
    virtual double range_m(uint32_t station) const = 0;

    /// Before boot() is over: the earliest moment at which a robot may begin a frame, 0 if it
    /// cannot be foreseen.
    virtual Cycles next_begin(uint32_t /*robot*/) const { return 0; }

    /// Whether any of its stations near `robot` may begin a frame until `until`.
    virtual bool begins_near(uint32_t /*robot*/, Cycles /*until*/) const { return false; }

    /// The frame of one of its stations begins: reaches everything in its range.
    virtual void shine(Frame & /*frame*/) {}

    /// A robot's frame begins at `from`: reaches those stations of this kind that are in range.
    virtual void shine_from_robot(Frame & /*frame*/, const Eigen::Vector2d & /*from*/) {}

    /// Carrier sense has ended for a frame of its own. The channel takes a `busy` one off the air.
    virtual void sensed(const Frame & /*frame*/, bool /*busy*/) {}

    /// After sensed(): a frame that found the channel busy is off the air.
    virtual void gave_up(const Frame & /*frame*/) {}

    /// A frame of its own has ended, and was received.
    virtual void sent(const Frame & /*frame*/) {}

    // --- Receiving ---

    /// Light of `frame` begins to fall on one of its stations; `reached.fate` says what the channel
    /// knows. It may become LOST if chance decides at the begin.
    virtual void light_begins(const Frame & /*frame*/, Reached & /*reached*/) {}

    /// A frame that reached one of its stations has ended. Frames whose CRC is wrong come, too.
    virtual void received(const Frame & /*frame*/, const Reached & /*reached*/) {}

    /// Light of `frame` goes on from `begin` to `end` at least: receivers that can choose stay with
    /// it.
    virtual void hold_receivers(const Frame & /*frame*/, Cycles /*begin*/, Cycles /*end*/) {}

    /// Brings what received() needs of one of its stations into the cache.
    virtual void prefetch(uint32_t /*station*/) const {}

    // --- Pulses: for kinds that see each pulse for itself, of whichever sender. ---

    /// A frame begins at `sender`: forgets whom its light reached before.
    virtual void forget_reached(uint32_t /*sender*/) {}

    /// The first pulse of the frame that `sender` begins at `at`.
    virtual void first_pulse(uint32_t /*sender*/, Cycles /*at*/) {}

    /// All but the first pulse of the frame that `sender` began at `at`.
    virtual void other_pulses(uint32_t /*sender*/, Cycles /*at*/, const message_t & /*message*/) {}
};

}  // namespace kilotwin

#endif
