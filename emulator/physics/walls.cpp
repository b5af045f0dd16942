#include "physics/walls.h"

#include <algorithm>
#include <numeric>

namespace kilotwin {

namespace {

constexpr double SQUARES_ACROSS = 255;  // at most, either way
// A square's side over the reach: its corners are then within reach of its middle.
constexpr double SIDE = 1.4;
// From a square's middle, over the reach: so far are walls that matter to a point in it, the ends
// of pieces that meet in a nook included.
constexpr double LISTED = 2.5;
// Where pieces and corners meet, a point belongs to both rather than to none.
constexpr double SEAM_M = 1e-12;

Eigen::Vector2d unit(const Eigen::Vector2d &v) {
    const double size = v.norm();
    return size > 0 ? Eigen::Vector2d(v / size) : Eigen::Vector2d::UnitX();
}

/// Whether a point is where robots can be.
bool is_free(const Eigen::Vector2d &point, const Region &bounds,
             const std::vector<Obstacle> &obstacles) {
    return bounds.contains(point) &&
           std::none_of(obstacles.begin(), obstacles.end(),
                        [&](const auto &obstacle) { return obstacle.shape.contains(point); });
}

}  // namespace

double Walls::Feature::gap(const Eigen::Vector2d &point) const {
    const Eigen::Vector2d offset = point - at;
    switch (kind) {
    case Kind::PIECE: {
        const double foot = along.dot(offset);
        return foot >= 0 && foot <= size_m ? normal().dot(offset) : INFINITY;
    }
    case Kind::CORNER:
        if (along.dot(offset) < -SEAM_M || beyond.dot(offset) > SEAM_M) return INFINITY;
        return sticks_out ? offset.norm() : -offset.norm();
    case Kind::HALL: return size_m - offset.norm();
    case Kind::PILLAR: return offset.norm() - size_m;
    }
    return INFINITY;
}

// In a nook both pieces bound the robots' place as if they went on: within one step a robot may
// come from where only one of them is nearest to where the other is. What lies behind the other
// piece is another place.
double Walls::Feature::reached(const Eigen::Vector2d &point, double reach_m) const {
    if (kind == Kind::CORNER && !sticks_out) return INFINITY;
    if (kind != Kind::PIECE) return gap(point);
    const Eigen::Vector2d offset = point - at;
    const double gap_m = normal().dot(offset), foot = along.dot(offset);
    if (gap_m < 0) return INFINITY;
    if (foot < 0 && (!begins_in_nook || foot < -reach_m || before.dot(offset) < 0)) return INFINITY;
    if (foot > size_m &&
        (!ends_in_nook || foot > size_m + reach_m || after.dot(offset - size_m * along) < 0))
        return INFINITY;
    return gap_m;
}

Eigen::Vector2d Walls::Feature::outward(const Eigen::Vector2d &point) const {
    if (kind == Kind::PIECE) return -normal();
    const bool away = kind == Kind::HALL || (kind == Kind::CORNER && !sticks_out);
    return unit(away ? Eigen::Vector2d(point - at) : Eigen::Vector2d(at - point));
}

double Walls::Feature::distance(const Eigen::Vector2d &point) const {
    switch (kind) {
    case Kind::PIECE: return edge_distance(point, at, at + size_m * along);
    case Kind::CORNER: return (point - at).norm();
    case Kind::HALL:
    case Kind::PILLAR: return std::abs((point - at).norm() - size_m);
    }
    return INFINITY;
}

/// Whether the straight line between two points crosses it.
bool Walls::Feature::is_crossed(const Eigen::Vector2d &from, const Eigen::Vector2d &to) const {
    if (kind == Kind::PILLAR) return edge_distance(at, from, to) < size_m;
    if (kind != Kind::PIECE) return false;  // nothing outside a hall sees anything
    const double one = cross(along, from - at), other = cross(along, to - at);
    if ((one > 0) == (other > 0)) return false;
    const Eigen::Vector2d where = from + (to - from) * (one / (one - other));
    const double foot = along.dot(where - at);
    return foot >= 0 && foot <= size_m;
}

Walls::Walls(const Region &bounds, bool bounds_block_light, const std::vector<Obstacle> &obstacles,
             double reach_m)
    : reach_m_(reach_m) {
    if (bounds.shape == Region::Shape::CIRCLE)
        features_.push_back({.kind = Feature::Kind::HALL,
                             .blocks_light = bounds_block_light,
                             .at = bounds.centre,
                             .size_m = bounds.size.x() / 2});
    else
        add_outline(bounds.outline(), bounds_block_light);
    for (const auto &[shape, blocks_light] : obstacles) {
        if (shape.shape == Region::Shape::CIRCLE) {
            features_.push_back({.kind = Feature::Kind::PILLAR,
                                 .blocks_light = blocks_light,
                                 .at = shape.centre,
                                 .size_m = shape.size.x() / 2});
            continue;
        }
        auto corners = shape.outline();
        std::reverse(corners.begin(), corners.end());  // robots are outside
        add_outline(std::move(corners), blocks_light);
    }
    all_.resize(features_.size());
    std::iota(all_.begin(), all_.end(), 0);
    make_grid(bounds, obstacles);
}

/// Adds pieces and corners of an outline that has the robots on its left.
void Walls::add_outline(std::vector<Eigen::Vector2d> corners, bool blocks_light) {
    const size_t count = corners.size();
    auto along = [&](size_t i) { return unit(corners[(i + 1) % count] - corners[i % count]); };
    auto sticks_out = [&](size_t i) { return cross(along(i + count - 1), along(i)) < 0; };
    auto normal = [&](size_t i) { return Eigen::Vector2d(-along(i).y(), along(i).x()); };
    for (size_t i = 0; i < count; i++) {
        features_.push_back({.kind = Feature::Kind::CORNER,
                             .blocks_light = blocks_light,
                             .sticks_out = sticks_out(i),
                             .at = corners[i],
                             .along = along(i + count - 1),
                             .beyond = along(i)});
        features_.push_back({.kind = Feature::Kind::PIECE,
                             .blocks_light = blocks_light,
                             .at = corners[i],
                             .size_m = (corners[(i + 1) % count] - corners[i]).norm(),
                             .along = along(i),
                             .begins_in_nook = !sticks_out(i),
                             .ends_in_nook = !sticks_out(i + 1),
                             .before = normal(i + count - 1),
                             .after = normal(i + 1)});
    }
}

// Squares without a wall in reach of their middle lie wholly on one side of all walls.
void Walls::make_grid(const Region &bounds, const std::vector<Obstacle> &obstacles) {
    reach_m_ = std::max(reach_m_, bounds.size.maxCoeff() / (SIDE * SQUARES_ACROSS));
    side_m_ = SIDE * reach_m_;
    low_ = bounds.centre - bounds.size / 2;
    columns_ = static_cast<int>(bounds.size.x() / side_m_) + 1;
    rows_ = static_cast<int>(bounds.size.y() / side_m_) + 1;
    squares_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
    for (Square &square : squares_) {
        const Eigen::Vector2d middle = middle_of(square);
        square.first = static_cast<uint32_t>(nearby_.size());
        square.gap_m = INFINITY;
        for (uint32_t wall : all_) {
            const double distance_m = features_[wall].distance(middle);
            square.gap_m = std::min(square.gap_m, distance_m);
            if (distance_m <= LISTED * reach_m_) nearby_.push_back(wall);
        }
        square.count = static_cast<uint32_t>(nearby_.size()) - square.first;
        if (!is_free(middle, bounds, obstacles)) square.gap_m = -square.gap_m;
    }
}

Eigen::Vector2d Walls::middle_of(const Square &square) const {
    const auto index = static_cast<int>(&square - squares_.data());
    const int column = index % columns_, row = index / columns_;
    return low_ + side_m_ * Eigen::Vector2d(column + 0.5, row + 0.5);
}

/// The square that a point is in; null outside all of them.
const Walls::Square *Walls::square_at(const Eigen::Vector2d &point) const {
    const Eigen::Vector2d place = (point - low_) / side_m_;
    if (!(place.x() >= 0 && place.y() >= 0 && place.x() < columns_ && place.y() < rows_))
        return nullptr;
    const auto column = static_cast<size_t>(place.x()), row = static_cast<size_t>(place.y());
    return &squares_[row * static_cast<size_t>(columns_) + column];
}

/// All walls within `reach_m` of a point, and more.
std::span<const uint32_t> Walls::near(const Eigen::Vector2d &point, double reach_m) const {
    const Square *square = reach_m <= reach_m_ ? square_at(point) : nullptr;
    if (square == nullptr) return all_;
    return {nearby_.data() + square->first, square->count};
}

Walls::Nearest Walls::nearest_of(std::span<const uint32_t> list,
                                 const Eigen::Vector2d &point) const {
    Nearest nearest;
    for (uint32_t wall : list) {
        const double gap_m = features_[wall].gap(point);
        if (std::abs(gap_m) < std::abs(nearest.gap_m)) nearest = {gap_m, wall};
    }
    return nearest;
}

double Walls::gap(const Eigen::Vector2d &point) const {
    const Square *square = square_at(point);
    if (square == nullptr) return nearest_of(all_, point).gap_m;
    const double listed_m =
        nearest_of({nearby_.data() + square->first, square->count}, point).gap_m;
    if (std::abs(listed_m) <= reach_m_) return listed_m;
    const double away_m = (point - middle_of(*square)).norm();
    const double bound_m = std::max(std::abs(square->gap_m) - away_m, reach_m_);
    return square->gap_m < 0 ? -bound_m : bound_m;
}

// Points on the line, as far from one another as walls in reach of a square are seen.
bool Walls::lets_light_pass(const Eigen::Vector2d &from, const Eigen::Vector2d &to) const {
    const Eigen::Vector2d way = to - from;
    const auto parts = static_cast<uint32_t>(std::ceil(way.norm() / reach_m_));
    for (uint32_t part = 0; part <= parts; part++) {
        const Eigen::Vector2d at =
            parts > 0 ? from + way * (static_cast<double>(part) / parts) : from;
        for (uint32_t wall : near(at, reach_m_))
            if (features_[wall].blocks_light && features_[wall].is_crossed(from, to)) return false;
    }
    return true;
}

}  // namespace kilotwin
