// The medium `kilobot` against a simulation by brute force, microsecond by microsecond.
#include <doctest/doctest.h>

#include <cmath>

#include "brute_channel.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_busy_channel {

namespace {

constexpr int RUNS = 8;
constexpr double RANGE_M = 0.08, CLOCK_SPREAD = 0.01;

const double DURATION_S = thorough() ? 30 : 4;

using Places = std::vector<Eigen::Vector2d>;

Places square_of_25(double spacing_m) {
    Places places;
    for (int i = 0; i < 25; i++) places.emplace_back(spacing_m * (i % 5), spacing_m * (i / 5));
    return places;
}

Places line_of(int count, double spacing_m) {
    Places places;
    for (int i = 0; i < count; i++) places.emplace_back(spacing_m * (i - count / 2), 0);
    return places;
}

BruteCounts by_brute_force(const Places &places, double range_m, uint64_t seed) {
    std::vector<std::vector<int>> audible(places.size());
    for (size_t i = 0; i < places.size(); i++)
        for (size_t j = 0; j < places.size(); j++)
            if (i != j && (places[i] - places[j]).norm() <= range_m)
                audible[i].push_back(static_cast<int>(j));
    return BruteChannel(audible, CLOCK_SPREAD, seed).run(DURATION_S);
}

BruteCounts by_engine(const Places &places, double range_m, uint64_t seed) {
    Scene scene(square_hall(3), seed);
    scene.def.profile = small_robot();
    scene.def.profile.legs = true;
    auto exact = infrared_settings();
    exact.range_spread = exact.loss = exact.loss_at_range = exact.gain_noise_lsb = 0;
    exact.range_m = range_m;
    scene.def.kilobot_medium = exact;
    scene.def.clock_spread = CLOCK_SPREAD;
    std::vector<Pose> poses;
    for (const auto &place : places) poses.push_back({place, 0});
    scene.add("talker", poses);
    Simulation simulation(scene.def);
    simulation.advance(static_cast<int64_t>(DURATION_S / TICK_S));
    auto counts = simulation.statistics().medium;
    auto real = [](uint64_t count) { return static_cast<double>(count); };
    return {real(counts.sent), real(counts.received), real(counts.collided), real(counts.deaf),
            real(counts.attempts_failed)};
}

struct Mean {
    double mean, error;  ///< standard error
};

Mean mean_of(const std::vector<BruteCounts> &runs, double BruteCounts::*what) {
    double sum = 0, squares = 0;
    for (const auto &run : runs) sum += run.*what;
    const double mean = sum / RUNS;
    for (const auto &run : runs) squares += (run.*what - mean) * (run.*what - mean);
    return {mean, std::sqrt(squares / (RUNS - 1) / RUNS)};
}

struct Compared {
    std::vector<BruteCounts> brute, engine;
};

// Two means of eight runs each: a difference of four standard errors comes about once in a thousand
// comparisons; a count or two in an hour of robots is granted where runs hardly differ.
Compared compare(const Places &places, double range_m) {
    Compared both;
    for (uint64_t seed = 1; seed <= RUNS; seed++) {
        both.brute.push_back(by_brute_force(places, range_m, seed));
        both.engine.push_back(by_engine(places, range_m, seed));
    }
    const std::pair<std::string, double BruteCounts::*> COUNTS[] = {
        {"sent", &BruteCounts::sent},
        {"received", &BruteCounts::received},
        {"collided", &BruteCounts::collided},
        {"deaf", &BruteCounts::deaf},
        {"failed", &BruteCounts::failed}};
    for (const auto &count : COUNTS) {
        const auto &name = count.first;  // clang lets no lambda take part of a structured binding
        const auto what = count.second;
        const Mean brute = mean_of(both.brute, what), engine = mean_of(both.engine, what);
        CAPTURE(name);
        CAPTURE(brute.mean);
        CAPTURE(brute.error);
        CAPTURE(engine.mean);
        CAPTURE(engine.error);
        const double bound = 4 * std::hypot(brute.error, engine.error) + 0.002 * brute.mean + 1;
        CHECK(std::abs(brute.mean - engine.mean) <= bound);
    }
    return both;
}

}  // namespace

TEST_CASE(
    "25 robots in range of one another send, fail and lose as many frames as by brute force") {
    auto both = compare(square_of_25(0.035), 0.3);
    CHECK(mean_of(both.brute, &BruteCounts::sent).mean > 25 * 1.8 * DURATION_S);
}

TEST_CASE("25 robots of which many are hidden from one another lose as many as by brute force") {
    auto both = compare(square_of_25(0.035), RANGE_M);
    const double sent = mean_of(both.brute, &BruteCounts::sent).mean;
    CHECK(mean_of(both.brute, &BruteCounts::collided).mean > 0.05 * sent);
}

TEST_CASE(
    "robots in a line, each hidden from all but the next two, lose as many as by brute force") {
    auto both = compare(line_of(21, 0.035), RANGE_M);
    CHECK(mean_of(both.brute, &BruteCounts::collided).mean > 0);
}

}  // namespace test_busy_channel
