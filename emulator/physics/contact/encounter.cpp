#include "physics/contact/encounter.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

void Driven::drive(const Shift &now_wanted, const Mechanics::Change &force) {
    Mechanics::Change most = force;
    // Mostly the force suffices, and no root is needed.
    if ((now_wanted.by - velocity.by).squaredNorm() > most.most_m_s * most.most_m_s)
        most.most_m_s += (now_wanted.by - wanted.by).norm();
    most.most_rad_s += std::abs(now_wanted.turn - wanted.turn);
    wanted = now_wanted;
    drive_on(most);
}

void Driven::drive_on(const Mechanics::Change &force) {
    const auto &[most_m_s, most_rad_s] = force;
    Eigen::Vector2d change = wanted.by - velocity.by;
    const double square = change.squaredNorm();
    if (square > most_m_s * most_m_s) {
        const double size = std::sqrt(square);
        if (size > most_m_s) change *= most_m_s / size;
    }
    velocity.by += change;
    velocity.turn += std::clamp(wanted.turn - velocity.turn, -most_rad_s, most_rad_s);
}

/// Impulses are over the mass. `across` is the part of the impulse that turns.
void Encounter::push(Shift &velocity, const Eigen::Vector2d &impulse, double across) const {
    velocity.by += impulse;
    velocity.turn += 2 * across / mechanics.radius_m;
    const double square = velocity.by.squaredNorm(), fastest_m_s = mechanics.fastest_m_s;
    if (square > fastest_m_s * fastest_m_s) velocity.by *= fastest_m_s / std::sqrt(square);
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
        Shift moved{-share * apart * towards, 0}, velocity = who.driven.velocity;
        moved.add(velocity, alone_s);
        if (touch) {
            push(velocity, impulse, across);
            moved.add(velocity, time_s - alone_s);
            who.driven.velocity = velocity;
        }
        who.moved = moved;
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
