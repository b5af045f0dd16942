// Counts in every kind of variable, each robot at its own pace, and prints them at tick 50.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "other.h"

int initialised = 1000;
int zeroed;
static int count = 7;  // other.c has one of the same name
static int table[32];
static int *cursor = table;
static const char *name = "nobody";

static int calls(void) {
    static int made = 100;
    return ++made;
}

static void setup(void) { name = kilo_uid % 2 ? "odd" : "even"; }

static void loop(void) {
    static uint32_t last;
    if (kilo_ticks == last || kilo_ticks > 50) return;
    last = kilo_ticks;
    initialised += kilo_uid;
    zeroed -= kilo_uid;
    count++;
    if (kilo_ticks % 10 == 0) *cursor++ = kilo_uid;
    for (int i = 1; i < kilo_uid; i++) calls();
    other_count();
    if (kilo_ticks == 50)
        printf("%d %d %d %d %d %d %s", initialised, zeroed, count, calls(), other_count(),
               (int)(cursor - table) * 100 + cursor[-1], name);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
