/// Objects: rigid things on the table that robots push. Lengths in metres, angles in radians,
/// counter-clockwise; masses in kg, forces in N, torques in N m.
///
/// An object is one part or several that are joined, each a circle or a convex polygon; its mass is
/// spread evenly over the areas of its parts, which should not overlap. Friction with the table is
/// Coulomb's: it holds an object until what pushes it is stronger.
#ifndef KILOTWIN_PHYSICS_OBJECTS_H
#define KILOTWIN_PHYSICS_OBJECTS_H

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "physics/contact/mechanics.h"
#include "physics/motion.h"

namespace kilotwin {

/// A circle (no corners) or a convex polygon of 3 to MOST_CORNERS corners, counter-clockwise.
struct ObjectPart {
    static constexpr size_t MOST_CORNERS = 8;

    Eigen::Vector2d centre{0, 0};  ///< of a circle
    double radius_m = 0;           ///< of a circle
    std::vector<Eigen::Vector2d> corners = {};

    /// Distance of a point from the outline, below 0 inside; a lower bound off a corner.
    double gap(const Eigen::Vector2d &point) const;
};

/// An object as an experiment describes it, in a frame of its own.
struct ObjectDef {
    std::vector<ObjectPart> parts;  ///< at least one
    std::optional<Pose> pose;       ///< of that frame when the run begins; none: by chance
    double mass_kg;
    double friction;          ///< with the table, against sliding: share of its weight
    double turning_friction;  ///< the same against turning
    double robot_friction;    ///< coefficient of friction with robots, walls and other objects
};

/// The parts of an object that do not change during a run. Its frame has its origin in the middle
/// of the mass.
class Object {
  public:
    /// EngineError for a part that is no circle, and no convex polygon.
    explicit Object(const ObjectDef &def);

    const std::vector<ObjectPart> &parts() const { return parts_; }
    double area_m2() const { return area_m2_; }
    double mass_kg() const { return mass_kg_; }
    double robot_friction() const { return robot_friction_; }
    double radius_m() const { return radius_m_; }  ///< of the circle around all of it

    /// The strongest force and torque of the table's friction.
    double most_force_n() const;
    double most_torque_nm() const;

    /// Distance of a point from an object at `pose`, below 0 inside; a lower bound near corners.
    double gap(const Pose &pose, const Eigen::Vector2d &point) const;

    /// Points all over its area, at most a twentieth of its size apart, and its corners.
    std::vector<Eigen::Vector2d> points(const Pose &pose) const;

    /// The pose of its middle from that of the frame of its definition, and back.
    Pose middle_of(const Pose &frame) const;
    Pose frame_of(const Pose &middle) const;

  private:
    void find_middle();
    double mean_distance_m() const;

    std::vector<ObjectPart> parts_;
    Eigen::Vector2d middle_{0, 0};  ///< in the frame of its definition
    double area_m2_ = 0, radius_m_ = 0;
    double mass_kg_, friction_, turning_friction_, robot_friction_;
    double mean_distance_m_ = 0;  ///< of its area from its middle: the lever of its friction
};

/// Where an object is, and how it moves.
struct ObjectState {
    Pose pose;       ///< of its middle
    Shift velocity;  ///< m/s, rad/s
    bool moves() const { return !velocity.by.isZero(0) || velocity.turn != 0; }
    /// No point of it within `radius_m` of its middle is faster.
    double most_m_s(double radius_m) const {
        return velocity.by.norm() + std::abs(velocity.turn) * radius_m;
    }
};

/// An object where it is when the run begins.
struct PlacedObject {
    Object object;
    Pose pose;  ///< of its middle
};

}  // namespace kilotwin

#endif
