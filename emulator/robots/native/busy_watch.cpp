#include "robots/native/busy_watch.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/fnv.h"

namespace kilotwin {

namespace {

// Budget of a program known to wait: it reacts to the interrupt, or waits on.
constexpr int32_t TURNS_WHILE_WAITING = 500;
// Iterations within which the state of a waiting program comes back.
constexpr uint16_t PROBES = 512;
constexpr Cycles ENDLESS_AFTER = 60 * CYCLES_PER_SECOND;
// Early looks: turns before the first one, some more than a guest that sleeps in each may take in
// STUCK_WALL_S (stack.h), and one in how many turns is compared with a kept state.
constexpr int32_t FIRST_LOOK = 32, COMPARED_SHARE = 8;

// By words of 8 bytes, which is faster: it only has to tell states apart.
uint64_t fnv(uint64_t hash, const uint8_t *begin, const uint8_t *end) {
    for (; begin + 8 <= end; begin += 8) {
        uint64_t word;
        std::memcpy(&word, begin, 8);
        take_word(hash, word);
    }
    take_bytes(hash, begin, static_cast<size_t>(end - begin));
    return hash;
}

/// Hash of the program's variables, without its count of ticks, which the engine changes, and of
/// its registers and frames.
uint64_t memory_fingerprint(const kt_table_t &table, const uint8_t *frame, const uint8_t *top) {
    auto ticks = reinterpret_cast<const uint8_t *>(const_cast<const uint32_t *>(table.ticks));
    uint64_t hash = fnv(FNV_OFFSET, table.state_begin, ticks);
    hash = fnv(hash, ticks + sizeof *table.ticks, table.state_end);
    return fnv(hash, frame, top);
}

/// Keeps the program's variables, its count of ticks among them, its registers and frames.
void keep(std::vector<uint8_t> &kept, const kt_table_t &table, const uint8_t *frame,
          const uint8_t *top) {
    kept.assign(table.state_begin, table.state_end);
    kept.insert(kept.end(), frame, top);
}

enum class Likeness : uint8_t { NONE, ALL_BUT_TICKS, ALL };

Likeness likeness(const std::vector<uint8_t> &kept, const kt_table_t &table, const uint8_t *frame,
                  const uint8_t *top) {
    auto ticks = reinterpret_cast<const uint8_t *>(const_cast<const uint32_t *>(table.ticks));
    const uint8_t *const after = ticks + sizeof *table.ticks;
    const uint8_t *was = kept.data();
    auto is_same = [&was](const uint8_t *begin, const uint8_t *end) {
        const auto bytes = static_cast<size_t>(end - begin);
        return std::memcmp(std::exchange(was, was + bytes), begin, bytes) == 0;
    };
    const auto bytes = static_cast<size_t>(table.state_end - table.state_begin + (top - frame));
    if (kept.size() != bytes || !is_same(table.state_begin, ticks)) return Likeness::NONE;
    const bool same_ticks = is_same(ticks, after);
    if (!is_same(after, table.state_end) || !is_same(frame, top)) return Likeness::NONE;
    return same_ticks ? Likeness::ALL : Likeness::ALL_BUT_TICKS;
}

/// Whether the x87 unit, whose registers are not among those compared, holds values: they are
/// pushed, so that the topmost is one then. Also if it has an exception that the next instruction
/// would raise.
bool holds_long_doubles() {
    constexpr uint16_t PENDING = 1 << 7, CLASS = 0x4500, EMPTY = 0x4100;
    uint16_t status;
    __asm__ volatile("fnstsw %0" : "=a"(status));
    if ((status & PENDING) != 0) return true;
    __asm__ volatile("fxam\n\tfnstsw %0" : "=a"(status));
    return (status & CLASS) != EMPTY;
}

}  // namespace

BusyWatch::Finding BusyWatch::look(Program &program, const uint8_t *frame, const uint8_t *top) {
    if (!watch_) watch_ = Own<Watch>::make();
    auto &budget = *program.table().budget;
    if (std::exchange(watch_->arrives, false)) return found_waiting(program);
    int32_t &held_back = program.turns_held_back;
    if (held_back > 0 && held_back + budget >= 0) return look_early(program, frame, top);
    held_back = 0;
    const uint64_t fingerprint = memory_fingerprint(program.table(), frame, top);
    budget = 0;
    if (watch_->probes_left == 0) {
        watch_->fingerprint = fingerprint;
        watch_->probes_left = PROBES;
        return Finding::LOOKING;
    }
    const bool waits = fingerprint == watch_->fingerprint;
    if (!waits && --watch_->probes_left > 0) return Finding::LOOKING;
    watch_->probes_left = 0;
    if (waits) return found_waiting(program);
    budget = TURNS_PER_TICK;
    return Finding::COMPUTES;
}

BusyWatch::Finding BusyWatch::found_waiting(Program &program) {
    *program.table().budget = TURNS_WHILE_WAITING;
    program.turns_held_back = 0;
    if (!program.looks_early) return Finding::WAITS;
    program.turns_to_look = FIRST_LOOK;
    watch_->comparisons_left = 0;
    watch_->spacing = 1;
    look_after(1, program);
    return Finding::WAITS;
}

// The budget counts down, and a look comes in the turn in which it falls below 0.
void BusyWatch::look_after(int32_t turns, Program &program) {
    int32_t &budget = *program.table().budget;
    const int32_t left = budget + program.turns_held_back;
    budget = std::min(turns - 1, left);
    program.turns_held_back = left - budget;
}

// A kept state that does not come back soon is followed by one after twice as many turns: a wait
// with a long period is found too, and few of all turns are compared.
BusyWatch::Finding BusyWatch::look_early(Program &program, const uint8_t *frame,
                                         const uint8_t *top) {
    Watch &watch = *watch_;
    const auto &table = program.table();
    const int32_t left = *table.budget + program.turns_held_back + 1;
    if (watch.comparisons_left == 0) {
        if (watch.spacing == 0) watch.spacing = program.turns_to_look;
        watch.left_when_kept = left;
        watch.comparisons_left = std::clamp<int32_t>(watch.spacing / COMPARED_SHARE, 1, PROBES);
        watch.acts_when_kept = watch.acts;
        keep(watch.kept, table, frame, top);
        look_after(1, program);
        return Finding::LOOKING;
    }
    const int32_t turns_since = watch.left_when_kept - left;
    watch.comparisons_left--;
    auto like = likeness(watch.kept, table, frame, top);
    if (watch.acts != watch.acts_when_kept || holds_long_doubles()) like = Likeness::NONE;
    if (like == Likeness::ALL) {
        const int32_t over = watch.left_when_kept % turns_since;
        if (over == 0) return found_waiting(program);
        watch.arrives = true;
        look_after(over, program);
    } else if (like == Likeness::ALL_BUT_TICKS) {
        look_after(TURNS_PER_TICK, program);  // it sets them itself: as without early looks
    } else if (watch.comparisons_left > 0) {
        look_after(1, program);
    } else {
        program.turns_to_look = std::min(2 * program.turns_to_look, TURNS_PER_TICK);
        look_after(watch.spacing, program);
        watch.spacing *= 2;
    }
    return Finding::LOOKING;
}

BusyWatch::Verdict BusyWatch::judge(Finding finding, Cycles now) {
    if (watch_->busy_since == NEVER) watch_->busy_since = now;
    if (finding == Finding::WAITS)
        watch_->computing_since = NEVER;
    else if (watch_->computing_since == NEVER)
        watch_->computing_since = now;
    if (watch_->computing_since != NEVER && now - watch_->computing_since >= ENDLESS_AFTER)
        return Verdict::ENDLESS;
    if (watch_->warned || now - watch_->busy_since < WARN_AFTER) return Verdict::FINE;
    watch_->warned = true;
    return Verdict::WARN;
}

}  // namespace kilotwin
