// Decides which edges of light a translated robot's interrupt comes too late for, and what a
// conversion makes of a frame's start (translated/robot.h).
#include <algorithm>
#include <cstdlib>

#include "robots/translated/robot.h"

namespace kilotwin {

namespace {

// Cycles in kilolib's machine code (firmware/kilolib/avr). From the comparator's interrupt up to
// where it reads when the edge came: up to there another edge takes its place. Up to where a byte's
// start puts off the timeout.
constexpr uint64_t CAPTURE_READ_CYCLES = 35, TIMEOUT_SET_CYCLES = 66;
// The original goes by when the interrupt comes: a bit may be read so much earlier or later.
constexpr int64_t MOST_SHIFT = SLOT_CYCLES / 2;
// A conversion that an edge triggers; a sensor's waits for its end. From where edges trigger again
// to the end of kilolib_converter_read().
constexpr uint64_t TRIGGERED_CYCLES = 108, TRIGGERED_AGAIN_CYCLES = 40;

}  // namespace

/// Whether the next edge's interrupt does more than take time: it ends a leader, for which the
/// program may wait, or belongs to a byte whose start has come late.
bool TranslatedRobot::edge_matters() {
    const SeenFrame &seen = *edge_light_;
    const bool ends_leader = seen.slot == STOP_SLOT && measures() != 0;
    return ends_leader || (seen.start_delay != 0 && seen.slot % BYTE_SLOTS != 0);
}

/// Whether the next edge is lost if its interrupt comes now: another one takes its place, its byte
/// has timed out, or the bit would be read as another one.
bool TranslatedRobot::loses_edge(uint64_t now) const {
    const SeenFrame &seen = *edge_light_;
    const bool is_original = seam_.original != 0;
    if (next_of_frame() <= now + (is_original ? 0 : CAPTURE_READ_CYCLES)) return true;
    if (seen.slot == 0) return false;
    const unsigned place = seen.slot % BYTE_SLOTS;
    const uint64_t byte_began =
        edge_at_ - (place == 0 ? BYTE_SLOTS : place) * SLOT_CYCLES + seen.start_delay;
    if (now + (place == 0 ? TIMEOUT_SET_CYCLES : 0) >= byte_began + BYTE_TIMEOUT) return true;
    const auto shift = static_cast<int64_t>(now - edge_at_) - seen.start_delay;
    return is_original && place != 0 && std::abs(shift) > MOST_SHIFT;
}

/// So long the next edge has waited, if it is a byte's start by which the original times the
/// others. The end of a block is nothing to wait for: passes that repeat are not asked where in one
/// it comes.
uint16_t TranslatedRobot::delay_of_start(uint64_t now) const {
    const uint64_t delay = now - edge_at_;
    if (seam_.original == 0 || delay <= MOST_HELD) return 0;
    return static_cast<uint16_t>(std::min<uint64_t>(delay, UINT16_MAX));
}

/// Notes of the next edge's frame that it is lost, if its interrupt comes now, or what is measured
/// of its begin if a conversion kept it waiting. Those that can be in the inbox no more are
/// forgotten.
void TranslatedRobot::note_flaw(uint64_t now) {
    constexpr int16_t MOST = 1023;
    SeenFrame &seen = *edge_light_;
    const bool is_lost = edge_at_ <= image_.forgotten || loses_edge(now);
    const bool is_unmeasured = seen.slot == 0 && edge_at_ <= image_.converted;
    if (seen.is_lost || !(is_lost || is_unmeasured)) return;
    seen.is_lost = is_lost;
    auto &flawed = rare_->flawed;
    const uint64_t known = std::min(cycle(), message_at_);
    std::erase_if(flawed, [&](const FlawedFrame &one) {
        return one.begin == seen.begin || one.begin + 2 * robot_.context->frame < known;
    });
    const int16_t measured = seam_.original != 0 ? image_.conversion : MOST;
    flawed.push_back({seen.begin, is_lost ? FlawedFrame::LOST : measured});
}

std::optional<int16_t> TranslatedRobot::take_flaw(uint64_t begin) {
    if (rare_ == nullptr) return std::nullopt;
    auto &flawed = rare_->flawed;
    const auto is_it = [&](const FlawedFrame &one) { return one.begin == begin; };
    const auto found = std::find_if(flawed.begin(), flawed.end(), is_it);
    if (found == flawed.end()) return std::nullopt;
    const int16_t high_gain = found->high_gain;
    flawed.erase(found);
    return high_gain;
}

/// Cycles that are left of the conversion that the last edge has triggered. None triggers one while
/// a sensor's goes on.
uint64_t TranslatedRobot::cycles_of_triggered() const {
    if (rare_ == nullptr) return 0;
    const uint64_t begin = cycle() + LOOK_CYCLES;
    const uint64_t edge = edge_at_ <= begin ? edge_at_ : rare_->last_edge;
    const uint64_t over = edge + TRIGGERED_CYCLES;
    return edge + TRIGGERED_AGAIN_CYCLES < image_.converted || over <= begin ? 0 : over - begin;
}

}  // namespace kilotwin
