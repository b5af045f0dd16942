/// The lossless medium of the foot-bots: everybody in range (and, if asked for, in sight) hears
/// every frame.
///
/// A frame that begins within a world step is heard at its end, but not before the next step
/// begins: so all robots can be run through a step one after the other. Range and sight go from
/// centre to centre, as robots stand at the beginning of the step; the discs of other robots hide
/// what is behind them, walls do not.
#ifndef KILOTWIN_ENGINE_IDEAL_MEDIUM_H
#define KILOTWIN_ENGINE_IDEAL_MEDIUM_H

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/memory.h"
#include "engine/neighbours.h"

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
          audiences_(robots) {}

    /// Who hears `sender`: some of those `around`, ascending. `place_of` says where a robot is.
    template <typename PlaceOf>
    const std::vector<Listener> &find_audience(uint32_t sender, Neighbours::List around,
                                               PlaceOf place_of) {
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
        choose_audience(audiences_[sender], from, around, found);
        return audiences_[sender];
    }

    /// Who heard `sender` when find_audience() was last called.
    const std::vector<Listener> &last_audience(uint32_t sender) const { return audiences_[sender]; }

    /// Bring into the cache where that stands, and then, some time later, itself.
    void prefetch_place(uint32_t sender) const { prefetch_line(&audiences_[sender]); }
    void prefetch(uint32_t sender) const { prefetch_line(audiences_[sender].data()); }

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
    std::vector<std::vector<Listener>> audiences_;
    std::vector<Eigen::Vector2d> places_;  ///< of those around a sender
    std::vector<InRange> in_range_;        ///< of them
};

}  // namespace kilotwin

#endif
