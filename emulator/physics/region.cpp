#include "physics/region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/trigonometry.h"

namespace kilotwin {

namespace {

// Sine of a turn that is none: such a corner lies on a straight edge.
constexpr double STRAIGHT = 1e-9;

/// Twice the area, above 0 if they go round counter-clockwise.
double signed_area(const std::vector<Eigen::Vector2d> &corners) {
    double sum = 0;
    for (size_t i = 0; i < corners.size(); i++)
        sum += cross(corners[i], corners[(i + 1) % corners.size()]);
    return sum;
}

/// Whether an edge goes past a point on its right, as seen along +x: half of even-odd.
bool passes_right(const Eigen::Vector2d &begin, const Eigen::Vector2d &end,
                  const Eigen::Vector2d &point) {
    if ((begin.y() > point.y()) == (end.y() > point.y())) return false;
    const double turn = cross(end - begin, point - begin);
    return end.y() > begin.y() ? turn > 0 : turn < 0;
}

/// Whether a corner is needed: it is not the next one, and edges turn there.
bool is_corner(const Eigen::Vector2d &before, const Eigen::Vector2d &at,
               const Eigen::Vector2d &after) {
    const Eigen::Vector2d in = at - before, out = after - at;
    return std::abs(cross(in, out)) > STRAIGHT * in.norm() * out.norm() || in.dot(out) < 0;
}

}  // namespace

Region Region::polygon(std::vector<Eigen::Vector2d> corners) {
    Eigen::Vector2d low = corners.front(), high = corners.front();
    for (const auto &corner : corners) {
        low = low.cwiseMin(corner);
        high = high.cwiseMax(corner);
    }
    return {Shape::POLYGON, (low + high) / 2, high - low, std::move(corners)};
}

Region Region::placed(const Eigen::Vector2d &by, double heading_rad) const {
    const Eigen::Vector2d ahead = direction(heading_rad);
    auto place = [&](const Eigen::Vector2d &point) -> Eigen::Vector2d {
        return by + turned(point, ahead);
    };
    if (shape == Shape::CIRCLE || shape == Shape::PICTURE) return {shape, place(centre), size};
    if (shape == Shape::RECTANGLE && heading_rad == 0) return {shape, centre + by, size};
    std::vector<Eigen::Vector2d> moved = shape == Shape::POLYGON ? corners : outline();
    std::transform(moved.begin(), moved.end(), moved.begin(), place);
    return polygon(std::move(moved));
}

bool Region::contains(const Eigen::Vector2d &point) const {
    if (shape == Shape::PICTURE) return false;
    const Eigen::Vector2d offset = point - centre;
    if (shape == Shape::CIRCLE) return offset.squaredNorm() <= size.x() * size.x() / 4;
    const bool in_box =
        std::abs(offset.x()) <= size.x() / 2 && std::abs(offset.y()) <= size.y() / 2;
    if (shape == Shape::RECTANGLE || !in_box) return in_box;
    bool inside = false;
    for (size_t i = 0; i < corners.size(); i++)
        inside ^= passes_right(corners[i], corners[(i + 1) % corners.size()], point);
    return inside;
}

double Region::distance_to_edge(const Eigen::Vector2d &point) const {
    const Eigen::Vector2d offset = point - centre;
    if (shape == Shape::CIRCLE) return std::abs(offset.norm() - size.x() / 2);
    // The largest norm of the offset from the edge's box: exact inside and beside it, too small off
    // its corners.
    if (shape == Shape::RECTANGLE)
        return std::abs(
            std::max(std::abs(offset.x()) - size.x() / 2, std::abs(offset.y()) - size.y() / 2));
    double nearest = std::numeric_limits<double>::infinity();  // which is a picture's
    for (size_t i = 0; i < corners.size(); i++)
        nearest =
            std::min(nearest, edge_distance(point, corners[i], corners[(i + 1) % corners.size()]));
    return nearest;
}

std::vector<Eigen::Vector2d> Region::outline() const {
    if (shape == Shape::CIRCLE || shape == Shape::PICTURE) return {};
    if (shape == Shape::RECTANGLE) {
        std::vector<Eigen::Vector2d> list;
        for (const auto &sign : {Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1),
                                 Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, 1)})
            list.push_back(centre + (size / 2).cwiseProduct(sign));
        return list;
    }
    std::vector<Eigen::Vector2d> list;
    for (size_t i = 0; i < corners.size(); i++) {
        const auto &before = list.empty() ? corners.back() : list.back();
        if (is_corner(before, corners[i], corners[(i + 1) % corners.size()]))
            list.push_back(corners[i]);
    }
    if (signed_area(list) < 0) std::reverse(list.begin(), list.end());
    return list;
}

double edge_distance(const Eigen::Vector2d &point, const Eigen::Vector2d &begin,
                     const Eigen::Vector2d &end) {
    const Eigen::Vector2d along = end - begin, offset = point - begin;
    const double square = along.squaredNorm();
    const double part = square > 0 ? std::clamp(offset.dot(along) / square, 0.0, 1.0) : 0;
    return (offset - part * along).norm();
}

}  // namespace kilotwin
