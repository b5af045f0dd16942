/// loop() once a tick, as `kilotwin port` tries a program that may count its passes: then it runs
/// equally often on the robot and here.
#include <kilolib.h>

#undef kilo_start
void kilo_start(void (*setup)(void), void (*loop)(void));

static void (*program_loop)(void);

static void once_a_tick(void) {
    static uint32_t last = 0xFFFFFFFF;
    const uint32_t now = kilo_ticks;
    if (now == last) return;
    last = now;
    program_loop();
}

void kilotwin_start(void (*setup)(void), void (*loop)(void)) {
    program_loop = loop;
    kilo_start(setup, once_a_tick);
}
