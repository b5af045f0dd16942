// Programs that end the whole worker, or spoil what it writes: chosen by WAY. They cost their own
// run alone.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "system_call.h"

extern const void *const *kt_host;  // the engine's functions that the API is made of
static char page[4096];
static const char NESTED[] = "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[";
static const char WORDS[] = "\033]0;owned\007\nkilotwin: all is well\n";

/// Writes over a file of the run folder.
static void write_over(const char *path, const char *text, long times) {
    const long file = call(2, (long)path, 01001, 0, 0);  // O_WRONLY, O_TRUNC
    for (; times > 0; times--) call(1, file, (long)text, sizeof WORDS - 1, 0);
}

/// A path in the run folder that ends in this number.
static const char *numbered(long number) {
    static char path[] = FOLDER "/run/00000";
    for (char *digit = path + sizeof path - 2; *digit != '/'; digit--, number /= 10)
        *digit = (char)('0' + number % 10);
    return path;
}

/// Ways to spoil files of the run folder.
static void spoil_files(void) {
    switch (WAY) {
    case 10:  // the manifest is no JSON any more
        write_over(FOLDER "/run/manifest.json", WORDS, 1);
        call(231, 0, 0, 0, 0);
        break;
    case 11:  // it is a list in a list in a list ...
        write_over(FOLDER "/run/manifest.json", NESTED, 10000);
        break;
    case 12:                                                      // it is a folder
        call(87, (long)FOLDER "/run/manifest.json", 0, 0, 0);     // unlink
        call(83, (long)FOLDER "/run/manifest.json", 0755, 0, 0);  // mkdir
        break;
    case 18:
        for (long i = 0; i < 3000; i++) call(3, call(2, (long)numbered(i), 0102, 0644, 0), 0, 0, 0);
        break;
    case 19:  // a folder in a folder in a folder ...
        for (long i = 0, at = call(2, (long)FOLDER "/run", 0, 0, 0); i < 3000; i++) {
            call(258, at, (long)"in", 0755, 0);  // mkdirat
            const long next = call(257, at, (long)"in", 0, 0);
            call(3, at, 0, 0, 0);
            at = next;
        }
        break;
    }
}

static void loop(void) {
    if (kilo_uid != 2) return;
    spoil_files();
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
    case 13: call6(25, (long)page & ~4095L, 4096, 4096, 3, engine, 0); break;  // mremap over it
    case 14: call(28, engine, 1 << 24, 4, 0); break;  // madvise: its variables are 0
    case 15: call(12, call(12, 0, 0, 0, 0) - (1 << 20), 0, 0, 0); break;  // brk: its heap is cut
    case 16:
        for (long file = 0; file < 64; file++) call(77, file, 0, 0, 0);  // ftruncate
        break;
    case 17:
        while (call(32, 1, 0, 0, 0) >= 0) {  // dup
        }
        break;
    }
}

static void setup(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
