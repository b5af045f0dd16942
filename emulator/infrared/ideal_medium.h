/// The lossless medium of the foot-bots: everybody in range (and, if asked for, in sight) hears
/// every frame.
///
/// A frame that begins within a world step is heard at its end, but not before the next step
/// begins: so all robots can be run through a step one after the other. Range and sight go from
/// centre to centre, as robots stand at the beginning of the step; the discs of other robots hide
/// what is behind them, walls do not.
#ifndef KILOTWIN_INFRARED_IDEAL_MEDIUM_H
#define KILOTWIN_INFRARED_IDEAL_MEDIUM_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "physics/neighbours.h"

namespace kilotwin {

struct Listener {
    uint32_t robot;
    uint16_t distance_mm;
};

class IdealMedium {
  public:
    IdealMedium(double range_m, bool line_of_sight, double radius_m, size_t robots)
        : range_m_(range_m),
          line_of_sight_(line_of_sight),
          radius_m_(radius_m),
          kept_(robots) {}

    /// Who hears `sender`: some of those `around`, ascending. `place_of` says where a robot is. What
    /// is returned lasts until the next call; with `keep`, kept_audience() returns it, too.
    template <typename PlaceOf>
    const std::vector<Listener> &find_audience(uint32_t sender, Neighbours::List around,
                                               PlaceOf place_of, bool keep) {
        if (places_.size() < around.size()) {
            places_.resize(around.size());
            in_range_.resize(around.size());
        }
        const Eigen::Vector2d from = place_of(sender);
        size_t found = 0;
        for (size_t i = 0; i < around.size(); i++) {
            places_[i] = place_of(around.begin()[i]);
            const double square = (places_[i] - from).squaredNorm();
            in_range_[found] = {i, square};
            found += square <= range_m_ * range_m_;
        }
        auto &audience = keep ? kept_[sender] : audience_;
        choose_audience(audience, from, around, found);
        return audience;
    }

    /// Who heard `sender` when that was last to be kept.
    const std::vector<Listener> &kept_audience(uint32_t sender) const { return kept_[sender]; }

  private:
    struct InRange {
        size_t place;
        double distance_squared;
    };

    void choose_audience(std::vector<Listener> &audience, const Eigen::Vector2d &from,
                         Neighbours::List around, size_t in_range);
    bool hidden(const Eigen::Vector2d &from, size_t listener, size_t others) const;

    double range_m_;
    bool line_of_sight_;
    double radius_m_;
    std::vector<std::vector<Listener>> kept_;  ///< by sender
    std::vector<Listener> audience_;           ///< that is not kept
    std::vector<Eigen::Vector2d> places_;      ///< of those around a sender
    std::vector<InRange> in_range_;            ///< of them
};

}  // namespace kilotwin

#endif
