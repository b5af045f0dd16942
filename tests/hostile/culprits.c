// Programs that mean harm, one for each uid; test_hostile.py says what becomes of each. They get at
// the system as a stranger's program would: by libc, which is linked, and by instructions.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "system_call.h"

int system(const char *command);
int fork(void);
long syscall(long number, ...);
int kill(int process, int signal);

static char page[4096] __attribute__((aligned(4096)));
static volatile uint32_t number;
static uint8_t done;  // each harms once, but for those that loop
static volatile long *volatile wild;

#define ASM(text) __asm__ volatile(text)

static uint32_t deeper(uint32_t depth) {
    volatile char frame[512];
    frame[0] = (char)depth;
    return deeper(depth + 1) + (uint32_t)frame[0];
}

static void (*volatile nowhere)(void);
static void *jump[5];

__attribute__((noinline)) static void by_libc(void) {
    switch (kilo_uid) {
    case 1: fork(); break;
    case 2: system("touch " VICTIM); break;
    case 3: kill((int)call(110, 0, 0, 0, 0), 9); break;  // its parent
    case 4: syscall(41, 2, 1, 0); break;                 // socket
    }
}

static void processes(void) {
    static char *words[] = {"/bin/touch", VICTIM, 0};
    switch (kilo_uid) {
    case 5: call(57, 0, 0, 0, 0); break;                         // fork
    case 6: call(58, 0, 0, 0, 0); break;                         // vfork
    case 7: call(56, 0x50f00, 0, 0, 0); break;                   // clone: a thread
    case 8: call(435, (long)page, 88, 0, 0); break;              // clone3
    case 9: call(59, (long)words[0], (long)words, 0, 0); break;  // execve
    case 10: call(62, -1, 9, 0, 0); break;                       // kill all
    case 11: call(200, call(110, 0, 0, 0, 0), 9, 0, 0); break;   // tkill
    case 12: call(101, 16, call(110, 0, 0, 0, 0), 0, 0); break;  // ptrace: attach
    case 13: call(311, call(110, 0, 0, 0, 0), 0, 0, 0); break;   // process_vm_writev
    case 14: call(41, 1, 1, 0, 0); break;                        // socket
    case 15: call(42, 3, (long)page, 16, 0); break;              // connect
    case 16: call(425, 8, (long)page, 0, 0); break;              // io_uring_setup
    case 17: ASM("mov $2, %eax; int $0x80"); break;              // fork, as 32-bit code does
    }
}

static void signals(void) {
    switch (kilo_uid) {
    case 18: call(13, 11, 0, (long)page, 8); break;  // sigaction
    case 19: call(14, 0, (long)page, 0, 8); break;   // sigprocmask
    case 20: call(37, 1, 0, 0, 0); break;            // alarm
    case 21: call(34, 0, 0, 0, 0); break;            // pause
    case 22: call(157, 1, 0, 0, 0); break;           // prctl: outlive the parent
    case 23: call(302, 0, 9, (long)page, 0); break;  // prlimit
    case 24: call(317, 1, 0, (long)page, 0); break;  // seccomp
    case 25: call(131, (long)page, 0, 0, 0); break;  // sigaltstack
    case 26: call(226, 0, 0, 0, 0); break;           // timer_delete
    }
}

static void files(void) {
    switch (kilo_uid) {
    case 27: printf("open %ld", call(2, (long)"/etc/passwd", 0, 0, 0)); break;
    case 28: printf("make %ld", call(2, (long)OUTSIDE "/new", 0102, 0644, 0)); break;
    case 29: printf("unlink %ld", call(87, (long)VICTIM, 0, 0, 0)); break;
    case 30: printf("rename %ld", call(82, (long)VICTIM, (long)OUTSIDE "/x", 0, 0)); break;
    case 31: printf("mkdir %ld", call(83, (long)OUTSIDE "/dir", 0755, 0, 0)); break;
    case 32: call(76, (long)VICTIM, 0, 0, 0); break;                      // truncate
    case 33: call(88, (long)VICTIM, (long)OUTSIDE "/link", 0, 0); break;  // symlink
    case 34: call(90, (long)VICTIM, 0777, 0, 0); break;                   // chmod
    case 35: call(319, (long)"x", 0, 0, 0); break;                        // memfd_create
    }
}

static void code(void) {
    switch (kilo_uid) {
    case 36: call(9, 0, 4096, 7, 0x22); break;                 // mmap: code of its own
    case 37: call(10, (long)page, 4096, 5, 0); break;          // mprotect: likewise
    case 38: *(volatile char *)(uintptr_t)by_libc = 0; break;  // over itself
    case 39: ((void (*)(void))(uintptr_t)page)(); break;       // into its variables
    case 40: nowhere(); break;                                 // to 0: as a reset
    case 41:
        wild = (long *)0x5deadbee0000;
        *wild = 1;
        break;
    case 42:
        wild = (long *)-4096;
        number = (uint32_t)*wild;
        break;
    case 43: number = deeper(0); break;
    case 44: ASM("xor %esp, %esp; push %rax"); break;
    case 45: ASM("push $0x1234; ret"); break;
    case 46: ASM("int3"); break;
    case 47: ASM("ud2"); break;
    case 48: ASM("hlt"); break;
    }
}

static void loops(void) {
    switch (kilo_uid) {
    case 49:
        for (;;) {
        }
    case 50:
        for (;;) number++;
    case 51: ASM("nop; .byte 0xeb, 0xfd"); break;
    case 52: __builtin_setjmp(jump); __builtin_longjmp(jump, 1);
    case 53:
        for (;;) delay(0);
    case 54:
        for (;;) printf("again and again\n");
    case 55:
        *(long *)page = 1000;
        for (;;) call(35, (long)page, 0, 0, 0);  // nanosleep
    case 56:
        for (;;) call(7, 0, 0, -1, 0);  // poll, for ever
    }
}

static void states(void) {
    static const uint32_t odd = 0x1f80 | 0xe040;  // towards zero, nothing denormal
    static const uint16_t single = 0x0c7f;
    switch (kilo_uid) {
    case 57: __asm__ volatile("ldmxcsr %0" ::"m"(odd)); break;
    case 58: __asm__ volatile("fldcw %0" ::"m"(single)); break;
    case 59: ASM("movq %rsp, %mm0; movq %rsp, %mm1"); break;  // without emms
    case 60: ASM("std"); break;
    }
}

static void loop(void) {
    if (done) return;
    by_libc();
    processes();
    signals();
    files();
    code();
    states();
    done = 1;
    loops();
}

static void setup(void) {}

int main(void) {
    kilo_init();
    debug_init();
    kilo_start(setup, loop);
    return 0;
}
