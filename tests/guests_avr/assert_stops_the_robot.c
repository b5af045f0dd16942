// assert() that holds does nothing; one that does not stops this robot: "passed" never comes.
#include <assert.h>

#include "check.h"

static void check(void) {
    assert(kilo_turn_left == kilo_turn_left);
    printf("before\n");
    assert(kilo_ticks == UINT32_MAX);
    printf("FAIL: went on\n");
}
