#include "physics/objects.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/trigonometry.h"
#include "physics/region.h"

namespace kilotwin {

namespace {

constexpr double GRAVITY_M_S2 = 9.81;

/// Calls `visit(point, area)` for small pieces of a part. Pieces of a triangle are similar to it,
/// those of a circle are pieces of rings of equal areas.
template <typename Visit> void for_each_piece(const ObjectPart &part, Visit visit) {
    constexpr int RINGS = 32, SPOKES = 64, ROWS = 24;
    if (part.corners.empty()) {
        const double area = PI * part.radius_m * part.radius_m / (RINGS * SPOKES);
        for (int ring = 0; ring < RINGS; ring++)
            for (int spoke = 0; spoke < SPOKES; spoke++)
                visit(part.centre + part.radius_m * std::sqrt((ring + 0.5) / RINGS) *
                                        direction(2 * PI * (spoke + 0.5) / SPOKES - PI),
                      area);
        return;
    }
    const auto &a = part.corners[0];
    for (size_t i = 2; i < part.corners.size(); i++) {
        const Eigen::Vector2d along = (part.corners[i - 1] - a) / ROWS;
        const Eigen::Vector2d up = (part.corners[i] - a) / ROWS;
        const double area = cross(along, up) / 2;
        for (int row = 0; row < ROWS; row++)
            for (int k = 0; k < ROWS - row; k++) {
                const Eigen::Vector2d corner = a + k * along + row * up;
                visit(corner + (along + up) / 3, area);
                if (k < ROWS - row - 1) visit(corner + (along + up) * 2 / 3, area);
            }
    }
}

/// Box2D takes convex polygons only, and few corners.
void check(const ObjectPart &part) {
    const auto &corners = part.corners;
    if (corners.empty() && part.radius_m > 0) return;
    const size_t count = corners.size();
    bool convex = count >= 3 && count <= ObjectPart::MOST_CORNERS;
    double turn = 0;
    for (size_t i = 0; convex && i < count; i++) {
        const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % count],
                              &c = corners[(i + 2) % count];
        convex = cross(b - a, c - b) > 0;
        turn += cross(a, b);
    }
    if (!convex || turn <= 0)
        throw EngineError("a part of an object is a circle or a convex polygon of 3 to 8 corners, "
                          "counter-clockwise");
}

}  // namespace

/// Beside an edge the largest distance from an edge's line is exact.
double ObjectPart::gap(const Eigen::Vector2d &point) const {
    if (corners.empty()) return (point - centre).norm() - radius_m;
    double gap_m = -std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < corners.size(); i++) {
        const Eigen::Vector2d along = (corners[(i + 1) % corners.size()] - corners[i]).normalized();
        gap_m = std::max(gap_m, -cross(along, point - corners[i]));
    }
    return gap_m;
}

Object::Object(const ObjectDef &def)
    : parts_(def.parts),
      mass_kg_(def.mass_kg),
      friction_(def.friction),
      turning_friction_(def.turning_friction),
      robot_friction_(def.robot_friction) {
    if (parts_.empty()) throw EngineError("an object has a part at least");
    for (const auto &part : parts_) check(part);
    find_middle();
    for (const auto &part : parts_) {
        if (part.corners.empty())
            radius_m_ = std::max(radius_m_, part.centre.norm() + part.radius_m);
        for (const auto &corner : part.corners) radius_m_ = std::max(radius_m_, corner.norm());
    }
    mean_distance_m_ = mean_distance_m();
}

/// Moves the parts so that the middle of the mass is the origin.
void Object::find_middle() {
    Eigen::Vector2d moment(0, 0);
    for (const auto &part : parts_)
        for_each_piece(part, [&](const Eigen::Vector2d &point, double area) {
            area_m2_ += area;
            moment += area * point;
        });
    middle_ = moment / area_m2_;
    for (auto &part : parts_) {
        part.centre -= middle_;
        for (auto &corner : part.corners) corner -= middle_;
    }
}

/// Mean distance of the area from the middle: pressure on the table is even.
double Object::mean_distance_m() const {
    double sum = 0;
    for (const auto &part : parts_)
        for_each_piece(
            part, [&](const Eigen::Vector2d &point, double area) { sum += area * point.norm(); });
    return sum / area_m2_;
}

double Object::most_force_n() const { return friction_ * mass_kg_ * GRAVITY_M_S2; }

double Object::most_torque_nm() const {
    return turning_friction_ * mass_kg_ * GRAVITY_M_S2 * mean_distance_m_;
}

double Object::gap(const Pose &pose, const Eigen::Vector2d &point) const {
    const Eigen::Vector2d at = turned(point - pose.position, direction(-pose.heading));
    double gap_m = INFINITY;
    for (const auto &part : parts_) gap_m = std::min(gap_m, part.gap(at));
    return gap_m;
}

std::vector<Eigen::Vector2d> Object::points(const Pose &pose) const {
    std::vector<Eigen::Vector2d> points;
    const Eigen::Vector2d ahead = direction(pose.heading);
    auto add = [&](const Eigen::Vector2d &point, double /*area*/ = 0) {
        points.push_back(pose.position + turned(point, ahead));
    };
    for (const auto &part : parts_) {
        for_each_piece(part, add);
        for (const auto &corner : part.corners) add(corner);
        for (int i = 0; part.corners.empty() && i < 64; i++)
            add(part.centre + part.radius_m * direction(2 * PI * i / 64 - PI));
    }
    return points;
}

Pose Object::middle_of(const Pose &frame) const {
    return {frame.position + turned(middle_, direction(frame.heading)), frame.heading};
}

Pose Object::frame_of(const Pose &middle) const {
    return {middle.position - turned(middle_, direction(middle.heading)), middle.heading};
}

}  // namespace kilotwin
