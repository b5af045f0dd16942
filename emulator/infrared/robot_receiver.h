/// Reception by robots of a frame that nothing spoils: lost by chance, or received with two
/// gains that tell the distance (hardware.md 1.10).
#ifndef KILOTWIN_INFRARED_ROBOT_RECEIVER_H
#define KILOTWIN_INFRARED_ROBOT_RECEIVER_H

#include <algorithm>
#include <array>
#include <vector>

#include "base/chance.h"
#include "base/memory.h"
#include "base/normal_pairs.h"
#include "base/prefetch.h"
#include "infrared/frames_in_flight.h"
#include "robots/robot.h"

namespace kilotwin {

/// Chance is keyed by robot and draw: receptions leave no state.
class RobotReceiver {
  public:
    /// Keys of `[medium]`.
    struct Settings {
        double loss;            ///< share of frames lost near the sender ...
        double loss_at_range;   ///< ... and at its range; grows with the distance's 4th power
        double gain_noise_lsb;  ///< sd of each converter reading
        /// sd, from robot to robot, of what each takes every distance to be more than it is
        double distance_error_mm;
        double overhead_loss;  ///< share of an overhead controller's frames lost
    };

    /// Readings of an overhead controller's light: strong, and from everywhere. A guess.
    static constexpr distance_measurement_t FROM_ABOVE = {400, 800};

    /// `chance` and `robots`, which are all there, must live on.
    RobotReceiver(const Settings &settings, const Chance &chance, const Swarm<Robot> &robots)
        : settings_(settings),
          chance_(chance),
          pairs_(chance),
          robots_(robots) {
        for (uint32_t robot = 0; robot < robots.size(); robot++) {
            const InfraredGains &gains = robots[robot].calibration().gains;
            receivers_.push_back(
                {static_cast<float>(draw_error_mm(robot)), gains.low(0), gains.are_measured()});
        }
    }

    /// Brings what measure() needs of a robot into the cache. Does not wait for it.
    void prefetch(uint32_t robot) const { prefetch_line(&receivers_[robot]); }

    /// Whether chance loses a frame at a robot. `draw` is the robot's own count of frames, of which
    /// those from above are none: they have numbers of their own.
    bool is_lost(const Frame &frame, const Reached &reached, uint64_t draw) const {
        if (frame.above > 0)
            return chance_.uniform(robots_[reached.station].index(), Purpose::OVERHEAD_LOSS,
                                   frame.above) < settings_.overhead_loss;
        return is_lost(reached.station, reached.distance_mm, frame.range_m, draw);
    }
    /// The same of a frame that is not from above.
    bool is_lost(uint32_t robot, float distance_mm, double range_m, uint64_t draw) const {
        const double share = distance_mm / 1000 / range_m;
        const double loss = settings_.loss + (settings_.loss_at_range - settings_.loss) * share *
                                                 share * share * share;
        return chance_.uniform(robots_[robot].index(), Purpose::FRAME_LOSS, draw) < loss;
    }

    /// The readings of a robot's converter for the frame's leader, noise included.
    distance_measurement_t measure(const Frame &frame, const Reached &reached,
                                   uint64_t draw) const {
        return frame.above > 0 ? FROM_ABOVE : measure(reached.station, reached.distance_mm, draw);
    }
    /// The same of a frame that is not from above.
    distance_measurement_t measure(uint32_t robot, float true_mm, uint64_t draw) const {
        std::array<double, 2> noise = {0, 0};
        if (settings_.gain_noise_lsb > 0)
            noise =
                pairs_.draw(robots_[robot].index(), {Purpose::LOW_GAIN, Purpose::HIGH_GAIN}, draw);
        const Receiver &receiver = receivers_[robot];
        const double distance_mm = true_mm + static_cast<double>(receiver.error_mm);
        const double low_lsb = settings_.gain_noise_lsb * noise[0],
                     high_lsb = settings_.gain_noise_lsb * noise[1];
        if (receiver.is_measured) [[unlikely]]
            return robots_[robot].calibration().gains.measure(distance_mm, low_lsb, high_lsb);
        return InfraredGains::measure_synthetic(receiver.low_at_contact, distance_mm, low_lsb,
                                                high_lsb);
    }

  private:
    /// The part of a robot's receiver that every frame needs: side by side, since its record has
    /// other lines of the cache.
    struct Receiver {
        float error_mm;           ///< that it takes every distance to be more than it is
        uint16_t low_at_contact;  ///< the first entry of its gains
        bool is_measured;         ///< its gains
    };

    // Cut as other spreads. What a lab has measured of a robot is right.
    double draw_error_mm(uint32_t robot) const {
        constexpr double LIMIT = 3;
        if (settings_.distance_error_mm == 0) return 0;
        if (robots_[robot].calibration().gains.are_measured()) return 0;
        const double drawn = chance_.normal(robots_[robot].index(), Purpose::DISTANCE_ERROR, 0);
        return settings_.distance_error_mm * std::clamp(drawn, -LIMIT, LIMIT);
    }

    Settings settings_;
    const Chance &chance_;
    NormalPairs pairs_;
    const Swarm<Robot> &robots_;
    Swarm<Receiver> receivers_;  ///< by robot
};

}  // namespace kilotwin

#endif
