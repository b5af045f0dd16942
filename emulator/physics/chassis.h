/// The chassis: turns duties of two motors into a drive (motion.h). Models the Kilobot's legs and
/// the foot-bot's wheels, how one robot differs from the next, and noise that changes each second.
#ifndef KILOTWIN_PHYSICS_CHASSIS_H
#define KILOTWIN_PHYSICS_CHASSIS_H

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "base/chance.h"
#include "base/clock.h"
#include "base/memory.h"
#include "base/normal_pairs.h"
#include "base/prefetch.h"
#include "base/slots.h"
#include "physics/motion.h"
#include "physics/motor_pair.h"

namespace kilotwin {

/// A kind of robot: mechanics and motors. All values come resolved from the host.
struct Profile {
    double radius_m;
    double speed_m_s;   ///< both motors at their straight duties
    double turn_rad_s;  ///< one motor at its turn duty
    double mass_kg;
    double push_m_s2;  ///< the drive's force over the robot's mass; friction when it is off
    uint8_t straight_left, straight_right, turn_left, turn_right;  ///< calibrated duties

    /// True: legs that shuffle (Kilobot): one motor alone turns the robot about a rear leg, speed
    /// goes with the duty, and a motor needs a kick to start. False: wheels (foot-bot): one motor
    /// alone turns it on the spot.
    bool legs;
    bool kick_needed;     ///< legs only: 15 ms at full duty, from standstill
    bool gives_way;       ///< whether it can be pushed while its motors are off
    double speed_spread;  ///< sd over robots, share of the speed
    double bias_spread;   ///< sd over motors, share of a motor's speed: such a robot bends aside
    double motor_noise;   ///< sd of each motor's speed from second to second, share of it
};

class Chassis {
  public:
    /// Draws what distinguishes each robot. `chance` and `slots` must outlive this.
    Chassis(const Profile &profile, const Chance &chance, const Slots &slots);

    /// Sets the duties, 0 to 255, of both motors of `robot` from `at` on. Returns the drive that
    /// results. Calls come in order of time for each robot.
    Drive set_duties(uint32_t robot, Cycles at, uint8_t left, uint8_t right);

    /// When renew() is due next for `robot`, since its motor noise changes; NEVER without.
    Cycles next_renewal(uint32_t robot) const { return motors_[robot].renewal; }
    /// Draws the next second's motor noise. Returns the drive that results.
    Drive renew(uint32_t robot);

    /// Multiplies the speeds of a robot's motors for good, from when its duties are next set on; up
    /// to the limit that all motors have. Wheels turn or not: they know 0 for both only.
    void scale_motors(uint32_t robot, double left, double right);

    /// Duties of its motors, left and right.
    const std::array<uint8_t, 2> &duties(uint32_t robot) const { return motors_[robot].pair.duty; }

    /// Seconds up to `now` that a robot's motors were on while neither turned.
    double hummed_s(uint32_t robot, Cycles now) const { return motors_[robot].pair.hummed_s(now); }

    /// Prefetches a robot's motors.
    void prefetch(uint32_t robot) const { prefetch_line(&motors_[robot]); }

    /// Limit of every robot's drive, m/s.
    double fastest_m_s() const { return fastest_m_s_; }

  private:
    /// Per robot; arrays of two hold left, right.
    struct alignas(64) Motors {
        MotorPair pair;
        Cycles renewal = NEVER;       ///< next_renewal()
        float speed = 1;              ///< share of the nominal speed
        uint32_t noise_draws = 0;     ///< seconds of noise drawn
        Eigen::Array2f share{1, 1};   ///< of the nominal speed, this motor's
        Eigen::Array2f wobble{1, 1};  ///< factor of this second's noise
    };
    /// Calibrated duties of both motors, and the turning that they make.
    struct Calibration {
        Eigen::Array2d duty;
        double turn_rad_s;  ///< of each leg
    };

    Drive drive(uint32_t robot) const;
    Drive drive_on_legs(uint32_t robot) const;
    void draw_noise(uint32_t robot);

    Profile profile_;
    const Slots &slots_;
    NormalPairs pairs_;     ///< noise of both motors is drawn at once
    double fastest_share_;  ///< limit of a motor, share of its calibrated speed
    double fastest_m_s_;
    std::array<Calibration, 2> calibrations_;  ///< one motor alone; both together
    Eigen::Array2d leg_m_;                     ///< rear legs: to the side, behind
    Swarm<Motors> motors_;
};

}  // namespace kilotwin

#endif
