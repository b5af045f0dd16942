#include "physics/contact/mechanics.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

void DrivenBody::drive(const Shift &now_wanted, const Mechanics::Change &force) {
    Mechanics::Change most = force;
    // Mostly the force suffices, and no root is needed.
    if ((now_wanted.by - velocity.by).squaredNorm() > most.most_m_s * most.most_m_s)
        most.most_m_s += (now_wanted.by - wanted.by).norm();
    most.most_rad_s += std::abs(now_wanted.turn - wanted.turn);
    wanted = now_wanted;
    drive_on(most);
}

void DrivenBody::drive_on(const Mechanics::Change &force) {
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

bool DrivenBody::change_wanted(const Shift &now_wanted) {
    const Eigen::Vector2d by = now_wanted.by - wanted.by;
    const double turn = now_wanted.turn - wanted.turn;
    if (by.isZero(0) && turn == 0) return false;
    wanted = now_wanted;
    drive_on({by.norm(), std::abs(turn)});
    return true;
}

DrivenBody::Rates DrivenBody::rates(const Mechanics &mechanics, double most_per_s) const {
    const auto most = mechanics.change_in(1);
    const double square = (wanted.by - velocity.by).squaredNorm();
    const double turn = std::abs(wanted.turn - velocity.turn);
    const double weak_m_s = most.most_m_s / most_per_s, weak_rad_s = most.most_rad_s / most_per_s;
    return {square > weak_m_s * weak_m_s ? most.most_m_s / std::sqrt(square) : most_per_s,
            turn > weak_rad_s ? most.most_rad_s / turn : most_per_s};
}

}  // namespace kilotwin
