#include "physics/placement.h"

#include <cmath>
#include <string>
#include <unordered_map>

#include "base/errors.h"
#include "base/trigonometry.h"

namespace kilotwin {

namespace {

constexpr uint64_t TRIES = 20'000;

/// Positions by squares of one diameter: a robot can only touch those of its square and of the
/// eight around it.
class Occupied {
  public:
    explicit Occupied(double diameter) : diameter_(diameter) {}

    void add(const Eigen::Vector2d &p) { squares_[key(column(p.x()), column(p.y()))].push_back(p); }

    bool is_free(const Eigen::Vector2d &p) const {
        for (int64_t x = column(p.x()) - 1; x <= column(p.x()) + 1; x++)
            for (int64_t y = column(p.y()) - 1; y <= column(p.y()) + 1; y++) {
                auto square = squares_.find(key(x, y));
                if (square == squares_.end()) continue;
                for (const auto &other : square->second)
                    if ((other - p).squaredNorm() < diameter_ * diameter_) return false;
            }
        return true;
    }

  private:
    int64_t column(double x) const { return static_cast<int64_t>(std::floor(x / diameter_)); }
    static int64_t key(int64_t x, int64_t y) { return x * (int64_t{1} << 32) + y; }

    double diameter_;
    std::unordered_map<int64_t, std::vector<Eigen::Vector2d>> squares_;
};

}  // namespace

void place_uniformly(std::vector<Pose> &poses, size_t count, const Arena &arena, double radius_m,
                     const Chance &chance) {
    Occupied occupied(2 * radius_m);
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
        } while (!arena.has_room(pose.position, radius_m) || !occupied.is_free(pose.position));
        pose.heading = wrapped(2 * PI * chance.uniform(robot, Purpose::HEADING, 0));
        occupied.add(pose.position);
        poses.push_back(pose);
    }
}

}  // namespace kilotwin
