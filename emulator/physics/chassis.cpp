#include "physics/chassis.h"

#include <algorithm>

namespace kilotwin {

namespace {

constexpr double SPREAD_LIMIT = 3;              // of a standard deviation
constexpr double FASTER_THAN_CALIBRATED = 1.2;  // limit above the calibrated duty
constexpr double FASTEST = 1.8;                 // limit of a motor that varies
constexpr Cycles NOISE_PERIOD = CYCLES_PER_SECOND;
constexpr size_t LEFT = 0, RIGHT = 1;

// The rear legs, in radii of the robot: 12.5 mm to the side and 9.2 mm behind the centre of a
// Kilobot of 16.5 mm.
constexpr double LEG_ASIDE = 12.5 / 16.5, LEG_BEHIND = 9.2 / 16.5;

double limited(double normal) { return std::clamp(normal, -SPREAD_LIMIT, SPREAD_LIMIT); }

}  // namespace

Chassis::Chassis(const Profile &profile, const Chance &chance, const Slots &slots)
    : profile_(profile),
      slots_(slots),
      pairs_(chance),
      fastest_share_(FASTER_THAN_CALIBRATED),
      fastest_m_s_(profile.speed_m_s),
      // Straight on, each turns the robot half as fast about its leg as would move it by itself.
      calibrations_{{{{double(profile.turn_left), double(profile.turn_right)}, profile.turn_rad_s},
                     {{double(profile.straight_left), double(profile.straight_right)},
                      profile.speed_m_s / (2 * LEG_ASIDE * profile.radius_m)}}},
      leg_m_(LEG_ASIDE * profile.radius_m, LEG_BEHIND * profile.radius_m),
      motors_(slots.size()) {
    if (!profile.legs) return;
    // Straight on, or the centre's way round the far leg.
    const double turning =
        profile.turn_rad_s * profile.radius_m * Eigen::Vector2d(LEG_ASIDE, LEG_BEHIND).norm();
    const bool varies = profile.speed_spread + profile.bias_spread + profile.motor_noise > 0;
    if (varies) fastest_share_ = FASTEST;
    fastest_m_s_ = std::max(profile.speed_m_s, turning) * fastest_share_;
    for (uint32_t robot = 0; robot < slots.size(); robot++) {
        const uint32_t index = slots.index_in(robot);
        auto &motors = motors_[robot];
        motors.speed = static_cast<float>(std::max(
            1 + profile.speed_spread * limited(chance.normal(index, Purpose::SPEED, 0)), 0.1));
        auto share = [&](Purpose purpose) {
            return static_cast<float>(1 + profile.bias_spread *
                                              limited(chance.normal(index, purpose, 0)));
        };
        motors.share = {share(Purpose::LEFT_BIAS), share(Purpose::RIGHT_BIAS)};
        draw_noise(robot);
    }
}

void Chassis::draw_noise(uint32_t robot) {
    if (profile_.motor_noise == 0) return;
    auto &motors = motors_[robot];
    const auto normals = pairs_.draw(
        slots_.index_in(robot), {Purpose::LEFT_NOISE, Purpose::RIGHT_NOISE}, motors.noise_draws);
    auto wobble = [&](double normal) {
        return static_cast<float>(1 + profile_.motor_noise * limited(normal));
    };
    motors.wobble = {wobble(normals[LEFT]), wobble(normals[RIGHT])};
}

Drive Chassis::set_duties(uint32_t robot, Cycles at, uint8_t left, uint8_t right) {
    auto &motors = motors_[robot];
    motors.pair.set(at, left, right, profile_.legs && profile_.kick_needed);
    if (!motors.pair.turns[LEFT] && !motors.pair.turns[RIGHT])
        motors.renewal = NEVER;
    else if (profile_.legs && profile_.motor_noise > 0 && motors.renewal == NEVER)
        motors.renewal = at + NOISE_PERIOD;
    return drive(robot);
}

Drive Chassis::renew(uint32_t robot) {
    motors_[robot].renewal += NOISE_PERIOD;
    motors_[robot].noise_draws++;
    draw_noise(robot);
    return drive(robot);
}

void Chassis::scale_motors(uint32_t robot, double left, double right) {
    motors_[robot].share *= Eigen::Array2f(static_cast<float>(left), static_cast<float>(right));
}

Drive Chassis::drive(uint32_t robot) const {
    if (profile_.legs) return drive_on_legs(robot);
    if ((motors_[robot].share == 0).all()) return {};
    const auto &duty = motors_[robot].pair.duty;
    const double left = duty[LEFT], right = duty[RIGHT];
    if (left == 0 && right == 0) return {};
    if (right == 0) return {{0, 0}, profile_.turn_rad_s};
    if (left == 0) return {{0, 0}, -profile_.turn_rad_s};
    double share = std::min({left / profile_.straight_left, right / profile_.straight_right, 1.0});
    return {{profile_.speed_m_s * share, 0}, 0};
}

// One motor alone turns the robot about a rear leg. With both, each turns it half as fast about its
// leg, and the sum goes straight on.
Drive Chassis::drive_on_legs(uint32_t robot) const {
    using Both = Eigen::Array2d;
    const auto &motors = motors_[robot];
    const auto &duty = motors.pair.duty;
    const auto &turns = motors.pair.turns;
    const bool turns_left = turns[LEFT], turns_right = turns[RIGHT];
    // Without branches: which motors turn could not be predicted.
    const auto &[calibrated, turn_rad_s] = calibrations_[turns_left & turns_right];
    const Both duties(duty[LEFT] * turns_left, duty[RIGHT] * turns_right);
    const Both shares = (duties / calibrated).min(FASTER_THAN_CALIBRATED) * motors.speed *
                        // Not cast(), which converts them one by one.
                        Both(motors.share[LEFT], motors.share[RIGHT]) *
                        Both(motors.wobble[LEFT], motors.wobble[RIGHT]);
    const Both rates = turn_rad_s * shares.max(0).min(fastest_share_);
    const double turn = rates[LEFT] - rates[RIGHT];
    return {leg_m_ * Both(rates[LEFT] + rates[RIGHT], turn), turn};
}

}  // namespace kilotwin
