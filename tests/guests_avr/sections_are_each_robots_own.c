// Variables that a program puts into sections of its own belong to one robot each, like all others.
#include "check.h"

static uint16_t kept __attribute__((section(".noinit")));
static uint16_t counted __attribute__((section(".mine"))) = 77;

static void check(void) {
    CHECK(kept == 0 && counted == 77);
    kept = counted = kilo_uid;
    delay(500);
    CHECK(kept == kilo_uid && counted == kilo_uid);
}
