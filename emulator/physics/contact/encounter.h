/// Robots that push: discs of one mass that a limited force drives; with their motors off the same
/// force holds them, as friction does. Two that meet, or one at a wall, go on in closed form: along
/// the line between them they stay together from when they touch, across it friction acts.
#ifndef KILOTWIN_PHYSICS_CONTACT_ENCOUNTER_H
#define KILOTWIN_PHYSICS_CONTACT_ENCOUNTER_H

#include <Eigen/Core>

namespace kilotwin {

constexpr double FRICTION = 0.3;  ///< of robots at one another and at walls

/// A change of place within one step, or (over its time) a velocity.
struct Shift {
    Eigen::Vector2d by{0, 0};  ///< m
    double turn = 0;           ///< rad

    /// The velocity that makes it in `time_s`.
    Shift velocity(double time_s) const { return {by / time_s, turn / time_s}; }

    /// Adds a way at a velocity.
    void add(const Shift &velocity, double time_s) {
        by += velocity.by * time_s;
        turn += velocity.turn * time_s;
    }
};

/// What robots are, as discs of one mass.
struct Mechanics {
    double radius_m;
    double push_m_s2;    ///< the force of the drive over the mass
    double part_m_s;     ///< those that overlap part so fast
    double fastest_m_s;  ///< nobody is pushed faster

    /// By how much the force of the drive can change a velocity in a time.
    struct Change {
        double most_m_s, most_rad_s;
    };
    Change change_in(double time_s) const {
        const double most_m_s = push_m_s2 * time_s;
        return {most_m_s, 2 * most_m_s / radius_m};  // a disc's inertia is m r^2 / 2
    }
};

/// A robot near a contact: a line of the cache.
struct alignas(64) Driven {
    Shift velocity;
    Shift wanted;  ///< the velocity that it was last driven at

    /// Brings its velocity nearer to the wanted one, as far as the force can. What it wants
    /// otherwise than before it gets at once, as robots do that nobody is near.
    void drive(const Shift &now_wanted, const Mechanics::Change &force);

    /// The same, wanting what it wanted before.
    void drive_on(const Mechanics::Change &force);
};

/// One of those who meet, and how far it has moved in this step.
struct Party {
    Driven &driven;
    Shift &moved;
};

struct Encounter {
    Mechanics mechanics;

    /// Moves a robot for `time_s`, and `other` unless that is null: a wall, or who does not give
    /// way. It lies in the direction `towards`, a unit vector; a gap below 0 is an overlap.
    void meet(const Party &robot, const Party *other, const Eigen::Vector2d &towards, double gap_m,
              double time_s) const;

  private:
    void push(Shift &velocity, const Eigen::Vector2d &impulse, double across) const;
};

}  // namespace kilotwin

#endif
