#include "physics/contact/closed_form.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

/// Applies an impulse over the mass; its tangential part turns the disc.
void ClosedForm::push(Shift &velocity, const Eigen::Vector2d &impulse, double tangential) const {
    velocity.by += impulse;
    velocity.turn += 2 * tangential / mechanics.radius_m;
    const double square = velocity.by.squaredNorm(), fastest_m_s = mechanics.fastest_m_s;
    if (square > fastest_m_s * fastest_m_s) velocity.by *= fastest_m_s / std::sqrt(square);
}

void ClosedForm::step(const ContactSide &robot, const ContactSide *other,
                      const Eigen::Vector2d &normal, double gap_m, double time_s) const {
    const Eigen::Vector2d tangent(-normal.y(), normal.x());
    Eigen::Vector2d closing = robot.body.velocity.by;
    double rims = robot.body.velocity.turn;
    if (other != nullptr) {
        closing -= other->body.velocity.by;
        rims += other->body.velocity.turn;
    }
    const double approach = closing.dot(normal);
    const bool touch = approach > 0 && std::max(gap_m, 0.0) < approach * time_s;
    const double free_s = touch ? std::max(gap_m, 0.0) / approach : time_s;
    const double separation = std::clamp(-gap_m, 0.0, mechanics.part_m_s * time_s);

    auto move = [&](const ContactSide &side, double share, const Eigen::Vector2d &impulse,
                    double tangential) {
        Shift moved{-share * separation * normal, 0}, velocity = side.body.velocity;
        moved.add(velocity, free_s);
        if (touch) {
            push(velocity, impulse, tangential);
            moved.add(velocity, time_s - free_s);
            side.body.velocity = velocity;
        }
        side.moved = moved;
    };
    // Along the normal a disc resists with its mass, at the rim across it with a third of that.
    const double bodies = other != nullptr ? 2 : 1;
    const double along = std::max(approach, 0.0) / bodies;
    const double slip = closing.dot(tangent) + mechanics.radius_m * rims;
    const double tangential = std::clamp(-slip / (3 * bodies), -FRICTION * along, FRICTION * along);
    const Eigen::Vector2d impulse = tangential * tangent - along * normal;
    move(robot, 1 / bodies, impulse, tangential);
    if (other != nullptr) move(*other, -1 / bodies, -impulse, tangential);
}

}  // namespace kilotwin
