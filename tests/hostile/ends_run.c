// Programs that end the whole worker, or spoil what it writes: chosen by WAY. They cost their own
// run alone.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "system_call.h"

extern const void *const *kt_host;  // the engine's functions that the API is made of
static char page[4096];
static const char WORDS[] = "\033]0;owned\007\nkilotwin: all is well\n";

static void loop(void) {
    if (kilo_uid != 2) return;
    const long engine = (long)(uintptr_t)kt_host[0] & ~4095L;
    switch (WAY) {
    case 1: call(231, 0, 0, 0, 0); break;                                         // exit_group
    case 2: call(234, call(39, 0, 0, 0, 0), call(186, 0, 0, 0, 0), 6, 0); break;  // tgkill
    case 3: call(11, engine - 65536, 1 << 20, 0, 0); break;    // munmap the engine
    case 4: call(9, engine - 65536, 1 << 20, 3, 0x32); break;  // mmap over it
    case 5:                                                    // into all that is open
        for (long file = 0; file < 64; file++) call(1, file, (long)page, sizeof page, 0);
        break;
    case 6:  // all the memory that it gets
        for (;;) {
            long got = call(9, 0, 1 << 22, 3, 0x22);
            if (got < 0) break;
            for (long at = 0; at < 1 << 22; at += 4096) *(volatile char *)(got + at) = 1;
        }
        for (int i = 0; i < 100000; i++) printf("more and more memory for what is printed\n");
        break;
    case 7:
        for (long file = 0; file < 64; file++) call(3, file, 0, 0, 0);  // close
        break;
    case 9:  // orders for the terminal, and a line like ours; then exit_group
        call(1, 2, (long)WORDS, sizeof WORDS - 1, 0);
        call(231, 0, 0, 0, 0);
        break;
    case 8:  // its own variables, which the engine puts aside for another robot's
        call(11, (long)page & ~4095L, 2 * sizeof page, 0, 0);
        break;
    }
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
