/// From the duties of two motors to motion: kinds of robots, and how one of a kind differs from the
/// next.
#ifndef KILOTWIN_PHYSICS_CHASSIS_H
#define KILOTWIN_PHYSICS_CHASSIS_H

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "base/chance.h"
#include "base/clock.h"
#include "base/memory.h"
#include "base/prefetch.h"
#include "physics/motion.h"

namespace kilotwin {

/// A kind of robot (design.md 5.1).
struct Profile {
    double radius_m;
    double speed_m_s;   ///< both motors at their straight duties
    double turn_rad_s;  ///< one motor at its turn duty
    double push_m_s2;   ///< the drive's force over the robot's mass; friction when it is off
    uint8_t straight_left, straight_right, turn_left, turn_right;  ///< calibrated duties

    /// True: legs that shuffle (Kilobot): one motor alone turns the robot about a rear leg, speed
    /// goes with the duty, and a motor needs a kick to start. False: wheels (foot-bot): one motor
    /// alone turns it on the spot.
    bool legs = false;
    bool kick_needed = true;  ///< legs only: 15 ms at full duty, from standstill
    double speed_spread = 0;  ///< sd over robots, share of the speed
    double bias_spread =
        0;  ///< sd over motors, share of the motor's speed: a robot that bends to one side
    bool gives_way = true;   ///< whether it can be pushed while its motors are off
    double motor_noise = 0;  ///< sd of each motor's speed from second to second, share of it
};

class Chassis {
  public:
    Chassis(const Profile &profile, const Chance &chance, size_t robots);

    /// From `at` on the motors of `robot` are at these duties.
    Drive set_duties(uint32_t robot, Cycles at, uint8_t left, uint8_t right);

    /// When the motion of `robot` next changes by itself, to be followed by renew(); NEVER while it
    /// rests.
    Cycles next_renewal(uint32_t robot) const { return motors_[robot].renewal; }
    Drive renew(uint32_t robot);

    /// Brings a robot's motors into the cache.
    void prefetch(uint32_t robot) const { prefetch_line(&motors_[robot]); }

    /// Nobody drives faster.
    double fastest_m_s() const { return fastest_m_s_; }

  private:
    /// Of a robot; where there are two, of the left motor and the right one.
    struct alignas(64) Motors {
        std::array<Cycles, 2> since = {0, 0};  ///< of the present duties
        Cycles renewal = NEVER;
        float speed = 1;              ///< share of the nominal speed
        uint32_t noise_draws = 0;     ///< one a second
        Eigen::Array2f share{1, 1};   ///< of the nominal speed, this robot's
        Eigen::Array2f wobble{1, 1};  ///< and what this second adds to it
        std::array<uint8_t, 2> duty = {0, 0};
        std::array<bool, 2> turns = {false, false};
    };
    /// Of both motors, straight on or one alone.
    struct Calibration {
        Eigen::Array2d duty;
        double turn_rad_s;  ///< of each leg
    };

    void set_duty(Motors &motors, size_t side, Cycles at, uint8_t duty) const;
    bool starts(const Motors &motors, size_t side, Cycles at, uint8_t duty) const;
    Drive drive(uint32_t robot) const;
    Drive drive_on_legs(uint32_t robot) const;
    void draw_noise(uint32_t robot);

    Profile profile_;
    const Chance &chance_;
    double fastest_share_;  ///< of the calibrated speed: no motor gets beyond
    double fastest_m_s_;
    std::array<Calibration, 2> calibrations_;  ///< for one motor alone, for both together
    Eigen::Array2d leg_m_;                     ///< how far the rear legs are aside and behind
    Swarm<Motors> motors_;
};

}  // namespace kilotwin

#endif
