#include "simulation/result_hash.h"

#include <bit>

#include "base/fnv.h"

namespace kilotwin {

namespace {

uint64_t pair_of(uint32_t high, uint32_t low) { return uint64_t{high} << 32 | low; }

// Acts of robots, and not what the emulator has to say about their programs.
bool is_of_robots(EventKind kind) {
    return kind != EventKind::NOTE && kind != EventKind::BUSY_WAIT && kind != EventKind::UNDEFINED;
}

uint64_t hash_of(const Event &event, Cycles zero) {
    uint64_t hash = FNV_OFFSET;
    take_word(hash, event.at - zero);
    take_word(hash, pair_of(event.robot, event.tick));
    take_word(hash, static_cast<uint64_t>(event.kind));
    // A crash's text tells addresses of this build.
    if (event.kind == EventKind::PRINT) take_bytes(hash, event.text.data(), event.text.size());
    return hash;
}

}  // namespace

uint64_t final_hash(const Samples &now) {
    uint64_t hash = FNV_OFFSET;
    for (size_t i = 0; i < now.led.size(); i++) {
        take_bytes(hash, &now.x_m[i], sizeof(float));
        take_bytes(hash, &now.y_m[i], sizeof(float));
        take_bytes(hash, &now.heading_rad[i], sizeof(float));
        take_bytes(hash, &now.led[i], 1);
    }
    for (size_t i = 0; i < now.object_x_m.size(); i++) {
        take_bytes(hash, &now.object_x_m[i], sizeof(float));
        take_bytes(hash, &now.object_y_m[i], sizeof(float));
        take_bytes(hash, &now.object_heading_rad[i], sizeof(float));
    }
    return hash;
}

void ResultHash::take(const Samples &samples) {
    const size_t moments = samples.tick.size(), robots = samples.led.size() / moments,
                 objects = samples.object_x_m.size() / moments;
    take_word(samples_, static_cast<uint64_t>(samples.tick.back()));
    for (size_t i = samples.led.size() - robots; i < samples.led.size(); i++) {
        take_word(samples_, pair_of(std::bit_cast<uint32_t>(samples.x_m[i]),
                                    std::bit_cast<uint32_t>(samples.y_m[i])));
        take_word(samples_, pair_of(std::bit_cast<uint32_t>(samples.heading_rad[i]),
                                    uint32_t{samples.led[i]} << 8 | samples.site[i]));
    }
    for (size_t i = samples.object_x_m.size() - objects; i < samples.object_x_m.size(); i++) {
        take_word(samples_, pair_of(std::bit_cast<uint32_t>(samples.object_x_m[i]),
                                    std::bit_cast<uint32_t>(samples.object_y_m[i])));
        take_word(samples_, std::bit_cast<uint32_t>(samples.object_heading_rad[i]));
    }
}

// A sum: robots run ahead of one another, so that the order of events depends on when they are
// fetched.
void ResultHash::take(const Events &events, Cycles zero) {
    for (const auto &event : events)
        if (is_of_robots(event.kind)) events_ += hash_of(event, zero);
}

uint64_t ResultHash::value(const Samples &now, const ChannelCounts &counts,
                           const std::vector<FrameCounts> &frames) const {
    uint64_t hash = final_hash(now);
    for (uint64_t word :
         {samples_, events_, counts.sent, counts.received, counts.wrong_crc, counts.attempts_failed,
          counts.collided, counts.deaf, counts.lost, counts.above_sent, counts.above_received})
        take_word(hash, word);
    for (const auto &[sent, received] : frames) take_word(hash, pair_of(sent, received));
    return hash;
}

}  // namespace kilotwin
