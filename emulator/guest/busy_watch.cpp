#include "guest/busy_watch.h"

#include <cstring>

#include "base/fnv.h"

namespace kilotwin {

namespace {

// Budget of a program known to wait: it reacts to the interrupt, or waits on.
constexpr int32_t TURNS_WHILE_WAITING = 500;
// Iterations within which the state of a waiting program comes back.
constexpr uint16_t PROBES = 512;
constexpr Cycles ENDLESS_AFTER = 60 * CYCLES_PER_SECOND;

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

}  // namespace

BusyWatch::Finding BusyWatch::look(const Program &program, const uint8_t *frame,
                                   const uint8_t *top) {
    if (!watch_) watch_ = std::make_unique<Watch>();
    auto &budget = *program.table().budget;
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
    budget = waits ? TURNS_WHILE_WAITING : TURNS_PER_TICK;
    return waits ? Finding::WAITS : Finding::COMPUTES;
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
