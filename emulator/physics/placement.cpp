#include "physics/placement.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "base/errors.h"
#include "base/trigonometry.h"

namespace kilotwin {

namespace {

constexpr uint64_t TRIES = 20'000;

/// Positions by squares of one diameter: a robot can only touch those of its square and of the
/// eight around it. The table is as long as there are positions, however large the arena: squares
/// far from one another may share a row of it.
class Occupied {
  public:
    /// For so many positions at most.
    Occupied(double diameter, size_t most)
        : diameter_(diameter),
          first_(std::bit_ceil(most), NONE) {
        placed_.reserve(most);
    }

    void add(const Eigen::Vector2d &p) {
        uint32_t &first = first_[row(square(p.x()), square(p.y()))];
        placed_.push_back({p, first});
        first = static_cast<uint32_t>(placed_.size() - 1);
    }

    bool is_free(const Eigen::Vector2d &p) const {
        const int64_t column = square(p.x()), line = square(p.y());
        for (int64_t x = column - 1; x <= column + 1; x++)
            for (int64_t y = line - 1; y <= line + 1; y++)
                for (uint32_t i = first_[row(x, y)]; i != NONE; i = placed_[i].next)
                    if ((placed_[i].position - p).squaredNorm() < diameter_ * diameter_)
                        return false;
        return true;
    }

  private:
    static constexpr uint32_t NONE = UINT32_MAX;
    struct Placed {
        Eigen::Vector2d position;
        uint32_t next;  ///< of the same row; NONE: it is the last
    };

    int64_t square(double way) const { return static_cast<int64_t>(std::floor(way / diameter_)); }
    /// Those of a column lie side by side, columns far from one another: the golden ratio.
    size_t row(int64_t x, int64_t y) const {
        constexpr uint64_t APART = 0x9E37'79B9'7F4A'7C15;
        return (static_cast<uint64_t>(x) * APART + static_cast<uint64_t>(y)) & (first_.size() - 1);
    }

    double diameter_;
    std::vector<uint32_t> first_;  ///< of each row: index in placed_
    std::vector<Placed> placed_;
};

}  // namespace

void place_uniformly(std::vector<Pose> &poses, size_t count, const Arena &arena, double radius_m,
                     const Chance &chance, const std::vector<PlacedObject> &objects) {
    auto clear_of_objects = [&](const Eigen::Vector2d &point) {
        return std::none_of(objects.begin(), objects.end(), [&](const PlacedObject &placed) {
            return placed.object.gap(placed.pose, point) < radius_m;
        });
    };
    Occupied occupied(2 * radius_m, poses.size() + count);
    for (const auto &pose : poses) occupied.add(pose.position);
    for (size_t i = 0; i < count; i++) {
        auto robot = static_cast<uint32_t>(poses.size());
        Pose pose;
        uint64_t tries = 0;
        do {
            if (tries == TRIES)
                throw EngineError("robot " + std::to_string(poses.size() + 1) +
                                  " finds no free place in the arena: use fewer robots or a "
                                  "larger arena");
            Eigen::Vector2d where(chance.uniform(robot, Purpose::PLACE, 2 * tries) - 0.5,
                                  chance.uniform(robot, Purpose::PLACE, 2 * tries + 1) - 0.5);
            pose.position = arena.bounds.centre + where.cwiseProduct(arena.bounds.size);
            tries++;
        } while (!arena.has_room(pose.position, radius_m) || !occupied.is_free(pose.position) ||
                 !clear_of_objects(pose.position));
        pose.heading = wrapped(2 * PI * chance.uniform(robot, Purpose::HEADING, 0));
        occupied.add(pose.position);
        poses.push_back(pose);
    }
}

namespace {

/// Whether an object overlaps nothing where it is; of other objects by their circles.
bool fits(const PlacedObject &placed, const std::vector<PlacedObject> &others,
          const std::vector<Pose> &robots, const Arena &arena, double radius_m) {
    const auto &[object, pose] = placed;
    for (const auto &other : others) {
        const double reach_m = object.radius_m() + other.object.radius_m();
        if ((other.pose.position - pose.position).norm() < reach_m) return false;
    }
    for (const Pose &robot : robots)
        if (object.gap(pose, robot.position) < radius_m) return false;
    const auto points = object.points(pose);
    return std::all_of(points.begin(), points.end(),
                       [&](const Eigen::Vector2d &point) { return arena.has_room(point, 0); });
}

}  // namespace

std::vector<PlacedObject> place_objects(const std::vector<ObjectDef> &objects,
                                        const std::vector<Pose> &robots, const Arena &arena,
                                        double radius_m, const Chance &chance) {
    std::vector<PlacedObject> placed;
    for (const ObjectDef &def : objects) {
        const Object object(def);
        placed.push_back({object, def.pose ? object.middle_of(*def.pose) : Pose()});
    }
    // Those with a pose come first, wherever they are in the list.
    std::vector<PlacedObject> others;
    for (size_t i = 0; i < placed.size(); i++)
        if (objects[i].pose) others.push_back(placed[i]);
    for (uint32_t i = 0; i < placed.size(); i++) {
        if (objects[i].pose) continue;
        auto draw = [&, n = uint64_t{0}]() mutable {
            return chance.uniform(i, Purpose::OBJECT_PLACE, n++);
        };
        Pose &pose = placed[i].pose;
        uint64_t tries = 0;
        do {
            if (tries++ == TRIES)
                throw EngineError("object " + std::to_string(i + 1) +
                                  " finds no free place in the arena: make it smaller or the "
                                  "arena larger");
            const double x = draw() - 0.5, y = draw() - 0.5;
            pose.position =
                arena.bounds.centre + Eigen::Vector2d(x, y).cwiseProduct(arena.bounds.size);
            pose.heading = wrapped(2 * PI * draw());
        } while (!fits(placed[i], others, robots, arena, radius_m));
        others.push_back(placed[i]);
    }
    return placed;
}

namespace {

/// The lower half of the bits, each one bit apart.
uint64_t spread(uint64_t bits) {
    bits = (bits | bits << 16) & 0x0000'FFFF'0000'FFFF;
    bits = (bits | bits << 8) & 0x00FF'00FF'00FF'00FF;
    bits = (bits | bits << 4) & 0x0F0F'0F0F'0F0F'0F0F;
    bits = (bits | bits << 2) & 0x3333'3333'3333'3333;
    return (bits | bits << 1) & 0x5555'5555'5555'5555;
}

}  // namespace

std::vector<uint32_t> by_place(const std::vector<Pose> &poses) {
    constexpr double SQUARE_M = 0.2;
    Eigen::Vector2d low(INFINITY, INFINITY);
    for (const Pose &pose : poses) low = low.cwiseMin(pose.position);
    struct Place {
        uint64_t square;
        uint32_t index;
    };
    std::vector<Place> places;
    places.reserve(poses.size());
    for (uint32_t index = 0; index < poses.size(); index++) {
        const Eigen::Vector2d way = (poses[index].position - low) / SQUARE_M;
        auto count = [](double squares) { return spread(static_cast<uint32_t>(squares)); };
        places.push_back({count(way.x()) | count(way.y()) << 1, index});
    }
    std::sort(places.begin(), places.end(), [](const Place &a, const Place &b) {
        return a.square != b.square ? a.square < b.square : a.index < b.index;
    });
    std::vector<uint32_t> order;
    order.reserve(places.size());
    for (const Place &place : places) order.push_back(place.index);
    return order;
}

}  // namespace kilotwin
