/// Settings for tests that build a run in C++, each written out: the engine has no defaults, and
/// users' defaults (host_tools/kilotwin/experiment) are none of a native test's business. A test
/// takes these and changes what it is about. Results of many tests, and the golden hash, depend on
/// them.
#ifndef KILOTWIN_TESTS_SETTINGS_H
#define KILOTWIN_TESTS_SETTINGS_H

#include "simulation/simulation.h"

namespace kilotwin::testing {

/// The paper's robot: wheels, no noise.
inline Profile foot_bot() {
    return {.radius_m = 0.085,
            .speed_m_s = 0.10,
            .turn_rad_s = 1.43,
            .mass_kg = 1.8,
            .push_m_s2 = 1.0,
            .straight_left = 70,
            .straight_right = 70,
            .turn_left = 65,
            .turn_right = 65,
            .legs = false,
            .kick_needed = true,
            .gives_way = true,
            .speed_spread = 0,
            .bias_spread = 0,
            .motor_noise = 0};
}

/// A Kilobot without noise, on legs if a test says so.
inline Profile small_robot() {
    Profile profile = foot_bot();
    profile.radius_m = 0.0165;
    profile.speed_m_s = 0.01;
    profile.turn_rad_s = 0.785;
    profile.mass_kg = 0.01;
    profile.push_m_s2 = 0.1;
    profile.straight_left = profile.straight_right = 65;
    profile.turn_left = profile.turn_right = 70;
    return profile;
}

inline VirtualFloor::Settings floor_settings() {
    return {.obstacle_m = 0.05, .step_ticks = 3, .repeat_ticks = 16};
}

/// With every mechanism of the Kilobots' infrared.
inline KilobotChannel::Settings infrared_settings() {
    KilobotChannel::Settings settings;
    settings.loss = 0.02;
    settings.loss_at_range = 0.20;
    settings.gain_noise_lsb = 2;
    settings.distance_error_mm = 0;
    settings.overhead_loss = 0;
    settings.range_m = 0.10;
    settings.range_spread = 0.05;
    settings.carrier_sense = true;
    settings.collisions = true;
    settings.half_duplex = true;
    settings.held_busy = false;
    return settings;
}

/// A grid without program or faults.
inline Grid::Settings grid_settings(uint32_t columns, uint32_t rows, uint32_t buses) {
    return {.columns = columns,
            .rows = rows,
            .buses = buses,
            .program = "",
            .name = "",
            .infrared = {.cell_range_m = 0.036,
                         .robot_range_m = 0.045,
                         .weak_share = 0.3,
                         .weak_range_m = 0.01,
                         .weak_spell_s = 120,
                         .loss = 0.02,
                         .clock_spread = 1e-4},
            .faults = {},
            .error_share = 0,
            .tier = Tier::NATIVE};
}

/// Foot-bots with the ideal medium in an arena; no robots yet, no floor, no commands.
inline SimulationDef definition(const Arena &arena) {
    return {.seed = 1,
            .step_ticks = 2,
            .arena = arena,
            .profile = foot_bot(),
            .floor = {},
            .range_m = 0.8,
            .line_of_sight = true,
            .kilobot_medium = {},
            .grid = {},
            .on_ticks = 0,
            .lead_ticks = 0,
            .light = {.ambient = 0, .sources = {}},
            .battery_h = 0,
            .readings = usual_readings(),
            .clock_spread = 0,
            .sensitivity_spread = 0,
            .groups = {},
            .lab = {},
            .commands = {},
            .sample_ticks = 305,
            .sample_extras = {},
            .black_box = "",
            .run_ahead = true};
}

}  // namespace kilotwin::testing

#endif
