#include "neighbours.h"

#include <stdbool.h>
#include <string.h>

#include "ticks.h"

// Expired senders are removed so often, while anybody is heard. No entry is then older than two
// time-outs and this, which is less than the 2^16 ticks at which its 16 bits would wrap.
#define SWEEP_TICKS 1024
#if 2 * NEIGHBOURS_TIMEOUT_MAX + SWEEP_TICKS > 65535
#error "an entry could wrap before it is swept"
#endif

void neighbours_init(neighbours_t *t, uint8_t capacity, uint16_t timeout_ticks) {
    memset(t, 0, sizeof *t);
    t->capacity = capacity;
    t->timeout_ticks = timeout_ticks;
}

static uint16_t age(uint16_t heard, uint32_t now) { return (uint16_t)((uint16_t)now - heard); }

// Keeps the order of those that stay. After a long silence 16 bits do not tell how old an entry
// is, but `latest` does.
static void sweep(neighbours_t *t, uint32_t now) {
    const bool silence = now - t->latest > t->timeout_ticks;
    uint8_t kept = 0;
    for (uint8_t i = 0; i < t->used; i++) {
        if (silence || age(t->heard[i], now) > t->timeout_ticks) continue;
        t->uid[kept] = t->uid[i];
        t->heard[kept] = t->heard[i];
        kept++;
    }
    t->used = kept;
    t->next = 0;
    t->swept = now;
}

// A new sender's place is where it was looked for, between those heard before and after it: this
// is what keeps the table in the order of hearing.
static void insert(neighbours_t *t, uint16_t uid) {
    for (uint8_t i = t->used; i > t->next; i--) {
        t->uid[i] = t->uid[i - 1];
        t->heard[i] = t->heard[i - 1];
    }
    t->uid[t->next] = uid;
    t->used++;
}

// The place of `uid`, a new one if need be, or `used` if there is none to be had.
static uint8_t find(neighbours_t *t, uint16_t uid, uint32_t now) {
    for (uint8_t i = 0; i < t->used; i++) {
        if (t->uid[i] == uid) return i;
    }
    if (t->used >= t->capacity) sweep(t, now);
    if (t->used >= t->capacity) {
        if (t->dropped < UINT16_MAX) t->dropped++;
        return t->used;
    }
    insert(t, uid);
    return t->next;
}

void neighbours_heard(neighbours_t *t, uint16_t uid, uint32_t now) {
    if (now - t->swept >= SWEEP_TICKS) sweep(t, now);
    t->latest = now;
    t->changes++;

    // Robots send in turn, each once in a period: nearly always it is the one after the last.
    uint8_t place = t->next;
    if (t->uid[place] != uid || place >= t->used) {
        place = find(t, uid, now);
        if (place == t->used) return;
    }
    t->heard[place] = (uint16_t)now;
    t->next = (uint8_t)(place + 1 < t->used ? place + 1 : 0);
}

// Volatile throughout, for the compiler must not move these reads past those of `changes`.
static uint8_t count(const volatile neighbours_t *t, uint32_t now, uint16_t limit) {
    const uint32_t latest = t->latest;
    if (!ticks_reached(now, latest)) now = latest;  // a tick and a message since the caller looked
    if (now - latest > limit) return 0;
    uint8_t n = 0;
    for (uint8_t i = 0; i < t->used; i++) {
        if (age(t->heard[i], now) <= limit) n++;
    }
    return n;
}

uint8_t neighbours_count(const neighbours_t *t, uint32_t now, uint16_t window_ticks) {
    const uint16_t limit = window_ticks < t->timeout_ticks ? window_ticks : t->timeout_ticks;
    uint8_t changes;
    uint8_t n;
    do {
        changes = t->changes;
        n = count(t, now, limit);
    } while (changes != t->changes);
    return n;
}
