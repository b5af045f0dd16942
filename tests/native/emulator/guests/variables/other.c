#include "other.h"

#include <kilolib.h>

static int count = -1;

static int made(void) {
    static int made = 0;
    return ++made;
}

int other_count(void) {
    count -= kilo_uid;
    return count * 1000 - made();
}
