/// Robots in range of a sender and, if asked for, in its sight: the receivers of the ideal channel.
///
/// Range and sight go from centre to centre; the discs of other robots hide what is behind them,
/// and walls that block light hide it in any case.
#ifndef KILOTWIN_INFRARED_RECEIVERS_IN_RANGE_H
#define KILOTWIN_INFRARED_RECEIVERS_IN_RANGE_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "physics/arena.h"
#include "physics/neighbours.h"

namespace kilotwin {

/// A robot that receives a frame.
struct Receiver {
    uint32_t robot;        ///< index
    uint16_t distance_mm;  ///< centre to centre, rounded
};

/// One per ideal channel; keeps the receivers of senders that stand.
class ReceiversInRange {
  public:
    /// `radius_m`: of the discs that hide others, if `line_of_sight` is needed. `arena` must live
    /// on. Senders of so many shares (base/team.h) are looked at side by side.
    ReceiversInRange(double range_m, bool line_of_sight, double radius_m, const Arena &arena,
                     size_t robots, uint32_t shares = 1)
        : range_m_(range_m),
          line_of_sight_(line_of_sight),
          radius_m_(radius_m),
          arena_(arena),
          kept_(robots),
          scratch_(shares) {}

    /// The receivers of `sender`: some of those `around`, ascending. `place_of` says where a robot
    /// is, in m. What is returned lasts until the next call for the sender's share; with `keep`,
    /// kept() returns it, too. Time O(around), with sight O(around * receivers).
    template <typename PlaceOf>
    const std::vector<Receiver> &find(uint32_t sender, Neighbours::List around, PlaceOf place_of,
                                      bool keep, uint32_t share = 0) {
        Scratch &scratch = scratch_[share];
        auto &[receivers_found, places, in_range] = scratch;
        if (places.size() < around.size()) {
            places.resize(around.size());
            in_range.resize(around.size());
        }
        const Eigen::Vector2d from = place_of(sender);
        size_t found = 0;
        for (size_t i = 0; i < around.size(); i++) {
            places[i] = place_of(around.begin()[i]);
            const double square = (places[i] - from).squaredNorm();
            in_range[found] = {i, square};
            found += square <= range_m_ * range_m_;
        }
        auto &receivers = keep ? kept_[sender] : receivers_found;
        choose(receivers, scratch, from, around, found);
        return receivers;
    }

    /// Result of the last find() for `sender` with `keep`.
    const std::vector<Receiver> &kept(uint32_t sender) const { return kept_[sender]; }

  private:
    /// A robot in range, seen or not.
    struct InRange {
        size_t place;             ///< in Scratch::places
        double distance_squared;  ///< m2
    };

    /// Memory of the search for one sender; a share has its own.
    struct alignas(64) Scratch {
        std::vector<Receiver> found;          ///< that is not kept
        std::vector<Eigen::Vector2d> places;  ///< of the robots around the sender
        std::vector<InRange> in_range;        ///< of them
    };

    void choose(std::vector<Receiver> &receivers, const Scratch &scratch,
                const Eigen::Vector2d &from, Neighbours::List around, size_t in_range) const;
    /// Whether one of the `others` nearer ones stands in the line to a receiver.
    bool hidden(const Scratch &scratch, const Eigen::Vector2d &from, size_t receiver,
                size_t others) const;

    double range_m_;
    bool line_of_sight_;
    double radius_m_;
    const Arena &arena_;
    std::vector<std::vector<Receiver>> kept_;  ///< by sender
    std::vector<Scratch> scratch_;             ///< by share
};

}  // namespace kilotwin

#endif
