#include "support.h"

#include <cstdlib>

#include <algorithm>

namespace kilotwin::testing {

bool thorough() { return std::getenv("KILOTWIN_TEST_LONG") != nullptr; }

std::string guest(const std::string &name) { return GUESTS "/" + name + ".so"; }

message_t message(uint8_t type, std::initializer_list<uint8_t> data) {
    message_t out = {};
    std::copy(data.begin(), data.end(), out.data);
    out.type = type;
    // CRC-16/MCRF4XX, bit by bit from its definition.
    uint16_t crc = 0xFFFF;
    auto take = [&crc](uint8_t byte) {
        for (int bit = 0; bit < 8; bit++, byte >>= 1) {
            bool feedback = (crc ^ byte) & 1;
            crc = static_cast<uint16_t>(feedback ? (crc >> 1) ^ 0x8408 : crc >> 1);
        }
    };
    for (uint8_t byte : out.data) take(byte);
    take(type);
    out.crc = crc;
    return out;
}

message_t run_message() { return message(RUN); }

Arena square_hall(double side_m) {
    return {{Region::Shape::RECTANGLE, {0, 0}, {side_m, side_m}}, {}};
}

Arena round_hall(double diameter_m) {
    return {{Region::Shape::CIRCLE, {0, 0}, {diameter_m, diameter_m}}, {}};
}

Scene::Scene(const Arena &arena, uint64_t seed) : def(definition(arena)) {
    def.seed = seed;
    def.commands.push_back({0, 0, UINT16_MAX, run_message()});
}

uint32_t Scene::add(const std::string &program, const std::vector<Pose> &poses) {
    uint32_t first = robots;
    def.groups.push_back({guest(program), program, poses.size(), poses, Tier::NATIVE});
    robots += static_cast<uint32_t>(poses.size());
    return first;
}

uint32_t Scene::add_anywhere(const std::string &program, size_t count) {
    uint32_t first = robots;
    def.groups.push_back({guest(program), program, count, {}, Tier::NATIVE});
    robots += static_cast<uint32_t>(count);
    return first;
}

void Scene::tell(int64_t tick, uint32_t robot, const message_t &what) {
    auto uid = static_cast<uint16_t>(robot + 1);
    def.commands.push_back({tick, uid, uid, what});
}

void Scene::tell_all(int64_t tick, const message_t &what) {
    def.commands.push_back({tick, 0, UINT16_MAX, what});
}

Scene crowd_on_kilobot_medium(uint64_t seed) {
    Scene scene(square_hall(seed % 2 ? 1.8 : 6), seed);
    scene.def.kilobot_medium = infrared_settings();
    scene.def.kilobot_medium->range_m = 0.6;
    scene.def.step_ticks = seed == 33 ? 1 : 4;
    scene.def.sample_ticks = 77;
    scene.add_anywhere("wanderer", 10);
    scene.add_anywhere("sender", 8);
    scene.add_anywhere("talker", 10);
    return scene;
}

Pose pose_of(const Samples &samples, uint32_t robot, size_t row) {
    size_t i = row * (samples.x_m.size() / samples.tick.size()) + robot;
    return {{samples.x_m[i], samples.y_m[i]}, samples.heading_rad[i]};
}

Bench::Bench(const std::vector<std::string> &programs, uint64_t seed)
    : chance_(seed),
      context_{chance_, events, emissions} {
    NativeGuest::serve_this_thread();
    for (const auto &name : programs) {
        auto &program = Program::load(guest(name), name);
        auto index = static_cast<uint32_t>(robots_.size());
        drivers_.push_back(std::make_unique<NativeDriver>(std::vector{&program}, 1));
        Calibration calibration = {TICK_CYCLES,    static_cast<uint16_t>(index + 1), 65, 66, 70, 71,
                                   InfraredGains()};
        robots_.emplace_back(context_, *drivers_.back(), index, calibration, 0);
    }
}

void Bench::tell(Cycles at, uint32_t robot, const message_t &what, int16_t distance_mm) {
    robots_[robot].receive(at, what, {distance_mm, distance_mm});
}

void Bench::run(Cycles until, Cycles slice) {
    while (now_ < until) {
        now_ = std::min(until, now_ + slice);
        for (auto &robot : robots_) robot.run(now_);
    }
}

std::vector<Event> Bench::prints(uint32_t robot) const {
    std::vector<Event> out;
    std::copy_if(events.begin(), events.end(), std::back_inserter(out),
                 [robot](const Event &event) {
                     return event.robot == robot && event.kind == EventKind::PRINT;
                 });
    return out;
}

std::vector<std::string> Bench::said(uint32_t robot) const { return texts(events, robot); }

std::vector<Event> Bench::others(uint32_t robot) const {
    std::vector<Event> out;
    std::copy_if(events.begin(), events.end(), std::back_inserter(out),
                 [robot](const Event &event) {
                     return event.robot == robot && event.kind != EventKind::PRINT;
                 });
    return out;
}

std::vector<Emission> Bench::sent(uint32_t robot) const {
    std::vector<Emission> out;
    std::copy_if(emissions.begin(), emissions.end(), std::back_inserter(out),
                 [robot](const Emission &emission) { return emission.robot == robot; });
    return out;
}

std::string text_without_address(const Event &event) {
    return event.text.substr(0, event.text.find(" at address"));
}

std::vector<std::string> texts(const Events &events, uint32_t robot, EventKind kind) {
    std::vector<std::string> out;
    for (const auto &event : events)
        if (event.robot == robot && event.kind == kind) out.push_back(event.text);
    return out;
}

}  // namespace kilotwin::testing
