#include "engine/encounter.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

void Driven::drive(const Shift &now_wanted, const Mechanics::Change &force) {
    const auto &[most_m_s, most_rad_s] = force;
    Eigen::Vector2d change = now_wanted.by - velocity.by;
    const double square = change.squaredNorm();
    if (square > most_m_s * most_m_s) {
        const double most = most_m_s + (now_wanted.by - wanted.by).norm(), size = std::sqrt(square);
        if (size > most) change *= most / size;
    }
    velocity.by += change;
    const double most_spin = most_rad_s + std::abs(now_wanted.turn - wanted.turn);
    velocity.turn += std::clamp(now_wanted.turn - velocity.turn, -most_spin, most_spin);
    wanted = now_wanted;
}

/// Impulses are over the mass. `across` is the part of the impulse that turns.
void Encounter::push(Driven &robot, const Eigen::Vector2d &impulse, double across) const {
    robot.velocity.by += impulse;
    robot.velocity.turn += 2 * across / mechanics.radius_m;
    const double square = robot.velocity.by.squaredNorm(), fastest_m_s = mechanics.fastest_m_s;
    if (square > fastest_m_s * fastest_m_s) robot.velocity.by *= fastest_m_s / std::sqrt(square);
}

void Encounter::meet(const Party &robot, const Party *other, const Eigen::Vector2d &towards,
                     double gap_m, double time_s) const {
    const Eigen::Vector2d aside(-towards.y(), towards.x());
    Eigen::Vector2d closing = robot.driven.velocity.by;
    double rims = robot.driven.velocity.turn;
    if (other != nullptr) {
        closing -= other->driven.velocity.by;
        rims += other->driven.velocity.turn;
    }
    const double nearer = closing.dot(towards);
    const bool touch = nearer > 0 && std::max(gap_m, 0.0) < nearer * time_s;
    const double alone_s = touch ? std::max(gap_m, 0.0) / nearer : time_s;
    const double apart = std::clamp(-gap_m, 0.0, mechanics.part_m_s * time_s);

    auto go = [&](const Party &who, double share, const Eigen::Vector2d &impulse, double across) {
        who.moved = {-share * apart * towards, 0};
        who.move(alone_s);
        if (!touch) return;
        push(who.driven, impulse, across);
        who.move(time_s - alone_s);
    };
    // Along the line a robot resists with its mass, at the rim across it with a third of that.
    const double bodies = other != nullptr ? 2 : 1;
    const double along = std::max(nearer, 0.0) / bodies;
    const double slip = closing.dot(aside) + mechanics.radius_m * rims;
    const double across = std::clamp(-slip / (3 * bodies), -FRICTION * along, FRICTION * along);
    const Eigen::Vector2d impulse = across * aside - along * towards;
    go(robot, 1 / bodies, impulse, across);
    if (other != nullptr) go(*other, -1 / bodies, -impulse, across);
}

}  // namespace kilotwin
