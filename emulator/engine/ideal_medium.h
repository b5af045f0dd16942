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
#include <span>
#include <vector>

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
          kept_(robots) {}

    /// Who hears `sender`: some of those `around`, ascending. `place_of` says where a robot is. What
    /// is returned lasts until the next call; with `keep`, kept_audience() returns it, too.
    template <typename PlaceOf>
    std::span<const Listener> find_audience(uint32_t sender, Neighbours::List around,
                                            PlaceOf place_of, bool keep) {
        if (audience_.size() < around.size() + 4) audience_.resize(2 * around.size() + 4);
        const Eigen::Vector2d from = place_of(sender);
        Listener *const audience = audience_.data();
        size_t found = 0;
        // No branch, and by fours: nobody could foresee either.
        for (const uint32_t *four = around.begin(); four < around.end(); four += 4) {
            const Eigen::Array4d squares = squares_of_four(
                from, place_of(four[0]), place_of(four[1]), place_of(four[2]), place_of(four[3]));
            const Eigen::Array4d distances_mm = (squares.sqrt() * 1000 + 0.5).min(65535);
            for (int i = 0; i < 4; i++) {
                audience[found] = {four[i], static_cast<uint16_t>(distances_mm[i])};
                found += (four + i < around.end()) & (squares[i] <= range_m_ * range_m_);
            }
        }
        if (line_of_sight_) {
            places_.clear();
            for (uint32_t other : around) places_.push_back(place_of(other));
            found = leave_visible(from, around, found);
        }
        if (keep) kept_[sender].assign(audience, audience + found);
        return {audience, found};
    }

    /// Who heard `sender` when that was last to be kept.
    std::span<const Listener> kept_audience(uint32_t sender) const { return kept_[sender]; }

  private:
    size_t leave_visible(const Eigen::Vector2d &from, Neighbours::List around, size_t found);
    bool hidden(const Eigen::Vector2d &from, size_t listener) const;

    double range_m_;
    bool line_of_sight_;
    double radius_m_;
    std::vector<std::vector<Listener>> kept_;  ///< by sender
    std::vector<Listener> audience_;           ///< the last one found, and room for more
    std::vector<Eigen::Vector2d> places_;      ///< of those around a sender
};

}  // namespace kilotwin

#endif
