#include "python/chance.h"

#include <nanobind/stl/string.h>

#include <array>
#include <string>
#include <utility>

#include "base/chance.h"
#include "base/errors.h"

namespace nb = nanobind;

namespace kilotwin {

namespace {

// Those of the engine are not here: a host cannot repeat what a robot drew.
constexpr std::array<std::pair<const char *, Purpose>, 5> PURPOSES = {{
    {"camera_miss", Purpose::CAMERA_MISS},
    {"camera_x", Purpose::CAMERA_X},
    {"camera_y", Purpose::CAMERA_Y},
    {"camera_heading", Purpose::CAMERA_HEADING},
    {"environment", Purpose::ENVIRONMENT},
}};

Purpose purpose_of(const std::string &name) {
    for (const auto &[known, purpose] : PURPOSES)
        if (name == known) return purpose;
    throw EngineError("the host draws nothing for " + name);
}

}  // namespace

// A Chance is two words, so one per call costs nothing.
void register_chance(nb::module_ &m) {
    m.def(
        "uniform",
        [](uint64_t seed, const std::string &purpose, uint32_t robot, uint64_t n) {
            return Chance(seed).uniform(robot, purpose_of(purpose), n);
        },
        nb::arg("seed"), nb::arg("purpose"), nb::arg("robot"), nb::arg("n"),
        "The n-th draw of a robot for a purpose, in [0, 1).");
    m.def(
        "normal",
        [](uint64_t seed, const std::string &purpose, uint32_t robot, uint64_t n) {
            return Chance(seed).normal(robot, purpose_of(purpose), n);
        },
        nb::arg("seed"), nb::arg("purpose"), nb::arg("robot"), nb::arg("n"),
        "The same with mean 0 and variance 1.");
}

}  // namespace kilotwin
