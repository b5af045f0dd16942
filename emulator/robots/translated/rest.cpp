// Ticks that are left out, since the passes of the main loop in them are known (known_pass.h).
#include <algorithm>
#include <cstddef>
#include <cstring>

#include "robots/translated/passes/pass_tracer.h"
#include "robots/translated/robot.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr int MOST_PAUSE = 255;
constexpr uint8_t LOOKS_FOR_COPIES = 4;

}  // namespace

/// The pass that begins, if it is known, and for how many ticks; one that is known beyond this tick
/// before one that is not.
const KnownPass *TranslatedRobot::find_known_pass(uint32_t &lasts) const {
    const uint16_t stack = word(SPL);
    const auto now = static_cast<uint8_t>(flags[6] << 6 | flags[7] << 7);
    const uint32_t ticks = ticks_now();
    const KnownPass *found = nullptr;
    lasts = 0;
    for (const KnownPass &one : learned_.known_passes.passes.all) {
        if (one.pc != pc || one.stack != stack || one.status != now) continue;
        const uint32_t so_long = one.lasts(data, ticks);
        if (so_long <= lasts) continue;
        lasts = so_long;
        found = &one;
        if (lasts > 1) break;
    }
    return found;
}

/// A pass of the main loop begins: whether it is known, traced now if need be, and for how long.
/// Where passes change something in each tick, it looks ever more seldom.
bool TranslatedRobot::recall() {
    if (at(seam_.robot) != ROBOT_RUNNING) return false;
    auto &known = learned_.known_passes;
    known.looks++;
    uint32_t lasts = 0;
    const KnownPass *found = find_known_pass(lasts);
    const bool may_follow = lasts == 1 && found->looks_for_copies < LOOKS_FOR_COPIES;
    if ((found == nullptr || may_follow) && lets_interrupts() && known.may_trace_pass()) {
        known.traces++;
        auto traced = known_pass_of(code_, *this);
        if (traced && (found == nullptr || !traced->copies.empty()))
            known.passes.keep(std::move(*traced));
        else if (found != nullptr)
            found->looks_for_copies++;
        found = find_known_pass(lasts);
    }
    // One that ends with this tick leaves nothing out, and looking for it costs as much.
    const int pause = lasts > 1 ? 0 : 2 * image_.recall_pause + 1;
    image_.recall_pause = static_cast<uint16_t>(std::min(pause, MOST_PAUSE));
    recalls_in = image_.recall_pause;
    if (found == nullptr) return false;
    image_.pass_cycles = found->cycles;
    image_.holds = false;  // none that holds interrupts is known
    image_.rest = rest_of(*found);
    image_.rest.ends = ticks_now() + lasts;
    if (written_ != nullptr) written_->leaves_out(found->rest.changes | found->first.changes);
    if (lasts > 1) recall_request(*found, lasts);
    return true;
}

/// The part of a pass that is kept while it goes on.
TickRest TranslatedRobot::rest_of(const KnownPass &known) {
    TickRest rest = {};
    rest.first_cycles =
        static_cast<uint16_t>(known.copies.empty() ? known.cycles : known.first_cycles);
    rest.reads_from = static_cast<uint16_t>(known.reads_from);
    rest.reads_to = static_cast<uint16_t>(known.reads_to);
    const size_t interrupted = std::min(known.interrupted.size(), std::size(rest.interrupted));
    std::copy_n(known.interrupted.begin(), interrupted, rest.interrupted);
    rest.is_whole = known.reads_from == known.reads_to ||
                    (interrupted > 0 && rest.interrupted[interrupted - 1].to == known.reads_to);
    for (size_t i = 0; i < known.copies.size(); i++)
        rest.copies[i] = {known.copies[i].address, known.copies[i].bytes};
    return rest;
}

/// While the pass is known the program may be requested for a message each time, and have none. It
/// is not known where the medium has to be asked before.
void TranslatedRobot::recall_request(const KnownPass &found, uint32_t lasts) {
    if (robot_.arbitrated || robot_.context->frame != 0) return;
    auto &known = learned_.known_passes;
    const uint32_t ticks = ticks_now();
    const auto use = [&](const KnownRequest &request) {
        const auto moves = [&](const auto &one) { return request.on.has(one.address, one.bytes); };
        if (std::any_of(found.copies.begin(), found.copies.end(), moves)) return false;
        const uint32_t so_long = request.on.lasts(data, ticks);
        if (so_long <= 1) return false;
        image_.rest.request_cycles = static_cast<uint16_t>(request.cycles);
        image_.rest.ends = ticks + std::min(lasts, so_long);
        if (written_ != nullptr) written_->leaves_out(request.on.changes);
        return true;
    };
    if (std::any_of(known.requests.all.begin(), known.requests.all.end(), use)) return;
    if (!ticks_are_plain() || can_count_tick() || !known.may_trace_request()) return;
    known.requests_traced++;
    if (auto request = known_request_of(code_, *this, SENSE_CALL_CYCLES))
        use(known.requests.keep(*request));
}

/// A tick interrupts a pass `phase` cycles from its start: cycles from there to the start of the
/// next pass that changes nothing, without the interrupt; 0: not known.
uint32_t TranslatedRobot::cycles_with_tick(uint32_t phase) const {
    const TickRest &rest = image_.rest;
    if (phase <= rest.reads_from) return rest.first_cycles;
    if (phase > rest.reads_to) return static_cast<uint32_t>(image_.pass_cycles) + rest.first_cycles;
    for (const auto &interrupted : rest.interrupted)
        if (phase <= interrupted.to) return interrupted.cycles;
    return 0;
}

/// While a pass is known over ticks: leaves out the ticks whose handler only counts, or requests a
/// message in vain. Each handler delays the passes behind it. True if there was one.
bool TranslatedRobot::take_ticks_at_rest() {
    const TickRest &rest = image_.rest;
    if (rest.ends == 0 || !ticks_are_plain() || image_.match < cycle()) return false;
    const uint64_t others = std::min({message_at_, serial_asks_at(), edge_at_, end_of_run()});
    const auto clock = static_cast<uint16_t>(seam_.robot + offsetof(robot_core_t, transmit));
    static_assert(offsetof(transmit_clock_t, increment) == 2, "as avr-gcc packs it");
    uint32_t counts = word(clock) + uint32_t{data[clock + 2]};
    const uint32_t period = word(seam_.tx_period), most = rest.ends - ticks_now() - 1;
    const auto idle = static_cast<uint32_t>(image_.pass_cycles);
    auto phase = static_cast<uint32_t>((image_.match - cycle()) % idle);
    uint32_t taken = 0;
    uint64_t now = 0;
    for (; taken < most; taken++, counts += TICK_MATCH) {
        const bool asks = (counts & UINT16_MAX) > period;
        const uint32_t interrupt = asks ? rest.request_cycles : learned_.tick_cycles;
        const uint32_t passes = cycles_with_tick(phase), takes = interrupt + passes;
        if (interrupt == 0 || passes == 0 || image_.match + takes + idle > others) break;
        now = image_.match - phase + takes;
        image_.match += TICK_CYCLES;
        phase = (TICK_CYCLES + phase - takes) % idle;
    }
    if (taken == 0) return false;
    passed = 1;
    image_.ticks_away = 0;
    count(taken);
    for (const auto &copy : rest.copies) {
        uint64_t value = 0;
        std::memcpy(&value, &at(copy.address), copy.bytes);
        value += taken;
        std::memcpy(&at(copy.address), &value, copy.bytes);
    }
    limit_ = std::max(now, limit_);
    set_cycle(now);
    return true;
}

/// World time up to which the robot's passes are known, unless it is requested for a message.
Cycles TranslatedRobot::rests_until() const {
    const TickRest &rest = image_.rest;
    if (rest.ends == 0 || image_.pass_cycles == 0 || !rest.is_whole || !ticks_are_plain() ||
        serial_asks_at() != TranslatedImage::NO_TIME)
        return 0;
    const uint32_t ticks = rest.ends - ticks_now();
    return clock_.world_time(image_.match + uint64_t{ticks - 1} * TICK_CYCLES);
}

}  // namespace kilotwin
