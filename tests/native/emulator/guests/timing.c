// Suspends deep in its stack, then prints every 100 ms.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

// `local` is reached by a pointer, so it must come back to the very place where it was.
static int deep(int depth) {
    int local[4];
    int *volatile pointer = local;
    for (int i = 0; i < 4; i++) local[i] = kilo_uid * 1000 + depth * 4 + i;
    delay(50);
    int sum = depth > 0 ? deep(depth - 1) : 0;
    for (int i = 0; i < 4; i++) sum += pointer[i] - kilo_uid * 1000;
    return sum;
}

static void setup(void) {
    printf("deep %d", deep(10));
    spinup_motors();
    printf("spun up");
    rand_hard();
    printf("drawn");
}

static void loop(void) {
    delay(100);
    printf("%lu", (unsigned long)kilo_ticks);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
