// Robot 1 computes what is not exact, in long double; robot 2 wants to be told of such things.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

static volatile long double third;

static void setup(void) {}

static void loop(void) {
    static const uint16_t told = 0x0300;
    third = 1;
    if (kilo_uid == 1) third /= 3;
    if (kilo_uid != 2 || kilo_ticks < 20) return;
    __asm__ volatile("fldcw %0; fldz; fstp %%st(0)" ::"m"(told));
    printf("lives on");
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
