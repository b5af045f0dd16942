#include "guest/busy_watch.h"

#include <cstring>

namespace kilotwin {

namespace {

// A program that waits needs but one look at what it waits for.
constexpr int32_t TURNS_WHILE_WAITING = 500;
// Turns that a program which waits takes at most, before it is where it was.
constexpr uint16_t PROBES = 512;
constexpr Cycles ENDLESS_AFTER = 60 * CYCLES_PER_SECOND;

uint64_t fnv(uint64_t hash, const uint8_t *begin, const uint8_t *end) {
    for (; begin + 8 <= end; begin += 8) {
        uint64_t word;
        std::memcpy(&word, begin, 8);
        hash = (hash ^ word) * 0x100000001B3u;
        hash ^= hash >> 29;
    }
    for (; begin < end; begin++) hash = (hash ^ *begin) * 0x100000001B3u;
    return hash;
}

/// Over the program's variables but its count of ticks, and its registers and frames.
uint64_t memory_fingerprint(const kt_table_t &table, const uint8_t *frame, const uint8_t *top) {
    auto ticks = reinterpret_cast<const uint8_t *>(const_cast<const uint32_t *>(table.ticks));
    uint64_t hash = fnv(0xCBF29CE484222325u, table.state_begin, ticks);
    hash = fnv(hash, ticks + sizeof *table.ticks, table.state_end);
    return fnv(hash, frame, top);
}

}  // namespace

void BusyWatch::forget() {
    watched_ = false;
    busy_since_ = computing_since_ = NEVER;
    probes_left_ = 0;
    warned_ = false;
}

BusyWatch::Finding BusyWatch::look(const Program &program, const uint8_t *frame,
                                   const uint8_t *top) {
    watched_ = true;
    auto &budget = *program.table().budget;
    const uint64_t fingerprint = memory_fingerprint(program.table(), frame, top);
    budget = 0;
    if (probes_left_ == 0) {
        fingerprint_ = fingerprint;
        probes_left_ = PROBES;
        return Finding::LOOKING;
    }
    const bool waits = fingerprint == fingerprint_;
    if (!waits && --probes_left_ > 0) return Finding::LOOKING;
    probes_left_ = 0;
    budget = waits ? TURNS_WHILE_WAITING : TURNS_PER_TICK;
    return waits ? Finding::WAITS : Finding::COMPUTES;
}

BusyWatch::Verdict BusyWatch::judge(Finding finding, Cycles now) {
    if (busy_since_ == NEVER) busy_since_ = now;
    if (finding == Finding::WAITS)
        computing_since_ = NEVER;
    else if (computing_since_ == NEVER)
        computing_since_ = now;
    if (computing_since_ != NEVER && now - computing_since_ >= ENDLESS_AFTER)
        return Verdict::ENDLESS;
    if (warned_ || now - busy_since_ < WARN_AFTER) return Verdict::FINE;
    warned_ = true;
    return Verdict::WARN;
}

}  // namespace kilotwin
