#include "physics/contact/island_solver.h"

#include <algorithm>
#include <cmath>

#include "base/clock.h"

namespace kilotwin {

namespace {

// Sub-steps a tick grow with the mean overlap, in diameters, from the first pair of numbers to the
// second: a loose crowd needs few; contacts of one that presses are as stiff as their square.
constexpr double LOOSE_SUB_STEPS = 0.75, LOOSE_OVERLAP = 0.004;
constexpr double TIGHT_SUB_STEPS = 3, TIGHT_OVERLAP = 0.008;
constexpr int LEAST_SUB_STEPS = 2;  // of one step

constexpr double PICOMETRE = 1e-12;

// A robot overlaps with a wall by no more than this, in diameters. In an acute nook its drive
// wedges it in: friction holds it against soft contacts, which push it out, and each push takes
// it deeper.
constexpr double MOST_WALL_OVERLAP = 0.04;
constexpr int WALL_PASSES = 8;  // in a nook: out of one wall may be into the other

int sub_steps_of(double time_s, double overlap) {
    const double tight = (overlap - LOOSE_OVERLAP) / (TIGHT_OVERLAP - LOOSE_OVERLAP);
    const double a_tick =
        LOOSE_SUB_STEPS + std::clamp(tight, 0.0, 1.0) * (TIGHT_SUB_STEPS - LOOSE_SUB_STEPS);
    return std::max(LEAST_SUB_STEPS, static_cast<int>(std::ceil(a_tick * time_s / TICK_S)));
}

}  // namespace

void IslandSolver::Closeness::add(const Closeness &other) {
    closing_m = std::max(closing_m, other.closing_m);
    overlaps_pm += other.overlaps_pm;
    overlapping += other.overlapping;
}

IslandSolver::Closeness IslandSolver::closeness(const Islands &islands, double swept_m) const {
    const double touch_m = 2 * mechanics_.radius_m;
    const double seen_m = SEEN_RADII * mechanics_.radius_m, found_m = touch_m + seen_m;
    Closeness found;
    for (const auto &body : islands.bodies)
        if (body.at_wall || swept_m >= 0)
            found.closing_m =
                std::max(found.closing_m, body.free.by.norm() + std::max(swept_m, 0.0));
    for (const auto &[one, other] : islands.pairs) {
        const auto &a = islands.bodies[one], &b = islands.bodies[other];
        const Eigen::Vector2d apart = b.pose.position - a.pose.position;
        const double square = apart.squaredNorm();
        if (square > touch_m * touch_m && square <= found_m * found_m) continue;
        const double distance_m = std::sqrt(square), gap_m = distance_m - touch_m;
        if (gap_m <= 0) {
            found.overlaps_pm += static_cast<int64_t>(-gap_m / PICOMETRE);
            found.overlapping++;
            continue;
        }
        const double closes_m = apart.dot(a.free.by - b.free.by) / distance_m;
        if (closes_m > gap_m) found.closing_m = std::max(found.closing_m, closes_m);
    }
    return found;
}

IslandSolver::Division IslandSolver::divide(const Closeness &of_all, double step_s,
                                            bool has_objects) const {
    const double seen_m = SEEN_RADII * mechanics_.radius_m;
    const int rounds = std::max(1, static_cast<int>(std::ceil(of_all.closing_m / seen_m)));
    double overlap = 0;
    if (has_objects)
        overlap = TIGHT_OVERLAP;
    else if (of_all.overlapping > 0)
        overlap = static_cast<double>(of_all.overlaps_pm) * PICOMETRE /
                  static_cast<double>(of_all.overlapping) / (2 * mechanics_.radius_m);
    return {rounds, sub_steps_of(step_s / rounds, overlap)};
}

Eigen::Vector2d IslandSolver::kept_off_walls(Eigen::Vector2d at) const {
    const double least_m = mechanics_.radius_m * (1 - 2 * MOST_WALL_OVERLAP);
    for (int pass = 0; pass < WALL_PASSES; pass++) {
        double nearest_m = least_m;
        Eigen::Vector2d out(0, 0);
        arena_.for_each_wall(at, mechanics_.radius_m,
                             [&](double gap_m, const Eigen::Vector2d &outward, uint32_t /*wall*/) {
                                 if (gap_m >= nearest_m) return;
                                 nearest_m = gap_m;
                                 out = -outward;
                             });
        if (nearest_m == least_m) break;
        at += (least_m - nearest_m) * out;
    }
    return at;
}

}  // namespace kilotwin
