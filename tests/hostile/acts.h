/// Harmful acts, of which ACT is done, once a robot or module. Included by programs that mean harm.
#ifndef ACTS_H
#define ACTS_H

#include "system_call.h"

static char page[64];
static const unsigned long every_signal[] = {~0UL};
static signed char did;  ///< what of it succeeded: 0 nothing

#ifdef __x86_64__
static void stand_still(void) {
    static const long hour[] = {3600, 0};
    if (ACT == 21) __asm__ volatile(".byte 0xeb, 0xfe");
    for (;;) call(35, (long)hour, 0, 0, 0);  // nanosleep
}

/// Goes on in stand_still(), as from a signal handler that had blocked every signal.
static void block_every_signal(void) {
    static unsigned long context[38], stack[512];
    context[3] = 2;  // no signal stack
    context[20] = (unsigned long)(stack + 500);
    context[21] = (unsigned long)stand_still;
    context[22] = 0x202;  // flags
    context[23] = 0x2b000000000033;
    context[37] = ~0UL;
    __asm__ volatile("mov %0, %%rsp; mov $15, %%eax; syscall" : : "r"(context) : "memory");
}
#else
static void block_every_signal(void) {}
#endif

static void harm(void) {
    static unsigned char done;
    if (done) return;
    done = 1;
    switch (ACT) {
    case 1: did = call(2, (long)OUTSIDE "/new", 0102, 0644, 0) >= 0; break;  // open
    case 2: did = call(2, (long)VICTIM, 0, 0, 0) >= 0; break;
    case 3: did = call(87, (long)VICTIM, 0, 0, 0) >= 0; break;  // unlink
    case 4:                                                     // fork
        if (call(57, 0, 0, 0, 0) == 0) {
            call(2, (long)OUTSIDE "/new", 0102, 0644, 0);
            call(231, 0, 0, 0, 0);  // exit_group
        }
        break;
    case 5: call(62, call(110, 0, 0, 0, 0), 9, 0, 0); break;  // kill, getppid
    case 6:
        call(41, 2, 1, 0, 0);
        break;  // socket
    // Of all files of the worker one is its parent's pipe, whose signals could go anywhere.
    case 7: call(72, 0, 8, call(110, 0, 0, 0, 0), 0); break;         // fcntl: F_SETOWN
    case 8: call(72, 0, 10, 9, 0); break;                            // fcntl: F_SETSIG
    case 9: call(72, 0, 4, 020000, 0); break;                        // fcntl: F_SETFL, O_ASYNC
    case 10: call(72, 0, 1031, 1 << 20, 0); break;                   // fcntl: F_SETPIPE_SZ
    case 11: call(16, 0, 0x5452, (long)page, 0); break;              // ioctl: FIOASYNC
    case 12: call6(271, 0, 0, 0, (long)every_signal, 8, 0); break;   // ppoll
    case 13: call6(270, 0, 0, 0, 0, 0, (long)page); break;           // pselect6
    case 14: call6(281, 0, 0, 0, -1, (long)every_signal, 8); break;  // epoll_pwait
    case 15: call(234, call(39, 0, 0, 0, 0), call(186, 0, 0, 0, 0), 19, 0); break;  // tgkill
    case 16: call(9, 0, 1 << 20, 3, 0x21); break;                                   // mmap: shared
    case 17: call(9, 0, 1 << 20, 3, 0x122); break;   // mmap: growing down
    case 18: call(293, (long)page, 0, 0, 0); break;  // pipe2
    case 19: call(285, 1, 0, 0, 1L << 32); break;    // fallocate
    case 21:
    case 22: block_every_signal(); break;
    case 20: call(290, 0, 0, 0, 0); break;  // eventfd2
    }
}

#endif
