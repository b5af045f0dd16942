/// Mechanics of robots in contact: discs of one mass and radius, each driven by a limited force.
/// With its motors off, the same force holds a robot in place, as friction on the floor does.
/// Lengths in metres, times in seconds, angles in radians, counter-clockwise.
#ifndef KILOTWIN_PHYSICS_CONTACT_MECHANICS_H
#define KILOTWIN_PHYSICS_CONTACT_MECHANICS_H

#include <Eigen/Core>

namespace kilotwin {

/// Coefficient of friction between two robots, and between a robot and a wall.
constexpr double FRICTION = 0.3;

/// A displacement within one step; or, per second, a velocity.
struct Shift {
    Eigen::Vector2d by{0, 0};  ///< m, or m/s
    double turn = 0;           ///< rad, or rad/s

    /// The constant velocity that makes this displacement in `time_s` (above 0).
    Shift velocity(double time_s) const { return {by / time_s, turn / time_s}; }

    /// Adds the displacement at `velocity` for `time_s`.
    void add(const Shift &velocity, double time_s) {
        by += velocity.by * time_s;
        turn += velocity.turn * time_s;
    }
};

/// Common to all robots of a run.
struct Mechanics {
    double radius_m;
    double mass_kg;      ///< of a robot
    double push_m_s2;    ///< force of the drive over the robot's mass
    double part_m_s;     ///< speed at which overlapping bodies separate: that of the fastest drive
    double fastest_m_s;  ///< limit of a robot's speed, driven or pushed

    /// The largest change of velocity that the drive's force makes in some time.
    struct Change {
        double most_m_s, most_rad_s;
    };
    /// For `time_s`, at least 0. The force acts at the rim; a disc's inertia is m r^2 / 2.
    Change change_in(double time_s) const {
        const double most_m_s = push_m_s2 * time_s;
        return {most_m_s, 2 * most_m_s / radius_m};
    }
};

/// Velocity of a robot near a contact, kept from step to step while it is.
struct DrivenBody {
    Shift velocity;  ///< now
    Shift wanted;    ///< what its drive was set to when it was last driven

    /// Drives towards `now_wanted`, which becomes `wanted`. `force` limits the change of velocity;
    /// what the program changed since the last call is added in full on top, as for a robot that
    /// nothing touches.
    void drive(const Shift &now_wanted, const Mechanics::Change &force);

    // The same for a solver that integrates over a long step: drive() in each of its ticks is a
    // force in proportion to what is missing, up to a limit.

    /// Makes `now_wanted` the wanted velocity, and adds what the program changed since the last
    /// call. Returns whether it changed anything.
    bool change_wanted(const Shift &now_wanted);

    /// How fast the drive brings the velocity to `wanted`, per second: acceleration over what is
    /// missing now.
    struct Rates {
        double by_per_s, turn_per_s;
    };
    /// At most `most_per_s`, and no more than the drive's force allows.
    Rates rates(const Mechanics &mechanics, double most_per_s) const;

  private:
    /// Drives towards `wanted`, with a change of velocity of `most`.
    void drive_on(const Mechanics::Change &most);
};

}  // namespace kilotwin

#endif
