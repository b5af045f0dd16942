// Attacks beyond those of culprits.c, one for each uid, in the order of three tables;
// test_attacks.py says what becomes of each. A call more is a line of a table.
#define DEBUG
#include <debug.h>
#include <kilolib.h>

#include "system_call.h"

static char page[4096] __attribute__((aligned(4096)));

#define PAGE (long)(uintptr_t)page
#define COUNT(table) (sizeof(table) / sizeof *(table))
#define ASM(text) __asm__ volatile(text)

/// Calls that are refused: number and arguments.
static const long CALLS[][7] = {
    {323, 1},                        // userfaultfd
    {321, 0, PAGE, 64},              // bpf
    {298, PAGE, 0, -1, -1},          // perf_event_open
    {250, 0, -3},                    // keyctl
    {248, PAGE, PAGE, PAGE, 8, -3},  // add_key
    {249, PAGE, PAGE},               // request_key
    {425, 8, PAGE},                  // io_uring_setup
    {206, 8, PAGE},                  // io_setup
    {434, 1},                        // pidfd_open
    {438, 0, 0},                     // pidfd_getfd
    {424, 0, 9},                     // pidfd_send_signal
    {310, 1, PAGE, 1, PAGE, 1},      // process_vm_readv
    {440, 0, PAGE, 1, 4},            // process_madvise
    {312, 1, 1},                     // kcmp
    {101, 0},                        // ptrace TRACEME
    {322, -100, PAGE, PAGE, PAGE},   // execveat
    {319, PAGE},                     // memfd_create
    {447, 0},                        // memfd_secret
    {56, 0x4100},                    // clone: a copy that shares memory
    {435, PAGE, 88},                 // clone3
    {272, 0x10000000},               // unshare: users
    {308, 0, 0},                     // setns
    {165, PAGE, PAGE, PAGE},         // mount
    {166, PAGE},                     // umount2
    {429, 0, PAGE, 0, PAGE},         // move_mount
    {430, PAGE},                     // fsopen
    {161, PAGE},                     // chroot
    {155, PAGE, PAGE},               // pivot_root
    {135, 0x400000},                 // personality: data are code
    {157, 4, 1},                     // prctl: PR_SET_DUMPABLE
    {157, 0x59616d61, -1},           // prctl: PR_SET_PTRACER
    {157, 35, 1, PAGE},              // prctl: PR_SET_MM
    {157, 22, 1},                    // prctl: PR_SET_SECCOMP
    {157, 59, 1},                    // prctl: PR_SET_SYSCALL_USER_DISPATCH
    {157, 36, 1},                    // prctl: PR_SET_CHILD_SUBREAPER
    {157, 29, -1},                   // prctl: PR_SET_TIMERSLACK
    {157, 26, 2},                    // prctl: PR_SET_TSC
    {158, 0x1002, PAGE},             // arch_prctl: ARCH_SET_FS
    {154, 1, PAGE, 16},              // modify_ldt
    {317, 1, 0, PAGE},               // seccomp: a filter more
    {444, PAGE, 8},                  // landlock_create_ruleset
    {446, 0},                        // landlock_restrict_self
    {329, PAGE, 4096, 5, -1},        // pkey_mprotect: executable
    {330, 0, 0},                     // pkey_alloc
    {10, PAGE, 4096, 7},             // mprotect: all rights
    {216, PAGE, 4096},               // remap_file_pages
    {9, 0, 4096, 1, 1, 0},           // mmap: a file, shared
    {9, 0, 4096, 1, 3, 0},           // mmap: of a file, shared and validated
    {9, 0, 4096, 5, 2, 0},           // mmap: a file's code
    {29, 0, 4096, 0600},             // shmget
    {30, 0},                         // shmat
    {68, 0, 0600},                   // msgget
    {64, 0, 1, 0600},                // semget
    {240, PAGE, 0102, 0600},         // mq_open
    {151, 3},                        // mlockall
    {238, 0},                        // set_mempolicy
    {303, -100, PAGE, PAGE, PAGE},   // name_to_handle_at
    {304, -100, PAGE},               // open_by_handle_at
    {437, -100, PAGE, PAGE, 24},     // openat2
    {278, 1, PAGE, 1},               // vmsplice
    {275, 0, 0, 1, 0, 64},           // splice
    {276, 0, 1, 64},                 // tee
    {41, 2, 3, 1},                   // socket: a raw one
    {41, 16, 3},                     // socket: netlink
    {41, 17, 3},                     // socket: packets
    {41, 38, 5},                     // socket: the kernel's ciphers
    {41, 40, 1},                     // socket: virtual machines
    {53, 1, 1, 0, PAGE},             // socketpair
    {44, 1, PAGE, 8},                // sendto
    {294, 0},                        // inotify_init1
    {300, 0},                        // fanotify_init
    {222, 0, PAGE, PAGE},            // timer_create: SIGEV_THREAD_ID
    {283, 1},                        // timerfd_create
    {38, 0, PAGE},                   // setitimer
    {289, -1, PAGE, 8},              // signalfd4
    {129, 1, 9, PAGE},               // rt_sigqueueinfo
    {297, 1, 1, 9, PAGE},            // rt_tgsigqueueinfo
    {62, 0, 9},                      // kill: its group
    {234, 1, 1, 6},                  // tgkill: SIGABRT to another process
    {130, PAGE, 8},                  // rt_sigsuspend
    {128, PAGE, PAGE, 0, 8},         // rt_sigtimedwait
    {203, 0, 8, PAGE},               // sched_setaffinity
    {144, 0, 1, PAGE},               // sched_setscheduler
    {314, 0, PAGE},                  // sched_setattr
    {141, 0, 0, -20},                // setpriority
    {251, 1, 0, 0},                  // ioprio_set
    {16, 0, 0x5412, PAGE},           // ioctl: TIOCSTI
    {16, 0, 0x540e, 1},              // ioctl: TIOCSCTTY
    {16, 1, 0x40049409, 0},          // ioctl: FICLONE
    {16, 0, 0x541c, PAGE},           // ioctl: TIOCLINUX
    {72, 0, 1024, 0},                // fcntl: F_SETLEASE
    {72, 0, 1026, 1},                // fcntl: F_NOTIFY
    {72, 0, 1033, 1},                // fcntl: F_ADD_SEALS
    {72, 1, 6, PAGE},                // fcntl: F_SETLK
    {160, 7, PAGE},                  // setrlimit
    {105, 0},                        // setuid
    {126, PAGE, PAGE},               // capset
    {112},                           // setsid
    {109, 0, 0},                     // setpgid
    {61, -1, 0},                     // wait4
    {80, PAGE},                      // chdir
    {86, PAGE, PAGE},                // link
    {266, PAGE, -100, PAGE},         // symlinkat
    {259, -100, PAGE, 010600},       // mknodat: a pipe
    {92, PAGE, 0, 0},                // chown
    {91, 1, 0777},                   // fchmod
    {280, -100, PAGE},               // utimensat
    {188, PAGE, PAGE, PAGE, 8},      // setxattr
    {76, PAGE, 0},                   // truncate
    {95, 0777},                      // umask
    {179, 0, PAGE},                  // quotactl
    {436, 0, -1},                    // close_range: all that is open
    {33, 0, 1},                      // dup2: over a file of the engine
    {292, 0, 1, 0},                  // dup3
    {449, PAGE, 1},                  // futex_waitv
    {448, 0},                        // process_mrelease
    {172, 3},                        // iopl
    {173, 0, 1, 1},                  // ioperm
    {170, PAGE, 1},                  // sethostname
    {227, 0, PAGE},                  // clock_settime
    {103, 3, PAGE, 64},              // syslog
    {169, 0},                        // reboot
    {246, 0},                        // kexec_load
    {175, PAGE, 1, PAGE},            // init_module
    {163, PAGE},                     // acct
    {167, PAGE},                     // swapon
    {212, 0},                        // lookup_dcookie
    {999},                           // a call that does not exist
    {-1},                            // a call with a negative number
    {0x40000002, PAGE},              // open, by the numbers of x32
};

/// Files that are not opened, where there is Landlock.
static const struct {
    const char *path;
    int flags;
} FILES[] = {
    {"/etc/passwd", 0},
    {"/etc/shadow", 0},
    {VICTIM, 0},
    {VICTIM, 01001},                       // O_TRUNC
    {OUTSIDE, 0200000},                    // O_DIRECTORY
    {OUTSIDE, 020200002},                  // O_TMPFILE
    {FOLDER "/run/../outside/new", 0102},  // O_CREAT
    {"/proc/self/cwd/outside/new", 0102},
    {"/proc/self/root" VICTIM, 2},
    {"/proc/self/mem", 2},
    {"/proc/self/environ", 0},
    {"/proc/self/maps", 0},
    {"/proc/self/fd/2", 2},
    {"/proc/1/environ", 0},
    {"/sys/kernel/notes", 0},
    {"/dev/shm/kilotwin-attack", 0102},
    {"/tmp/kilotwin-attack", 0102},
    {"/dev/ptmx", 2},
    {"/dev/tty", 2},
    {"/dev/kmsg", 1},
    {"/dev/random", 0},
    {"/var/tmp/kilotwin-attack", 0102},
};

static void open_by_32_bit_code(void) { ASM("mov $5, %eax; int $0x80"); }
static void open_by_a_wide_number(void) {
    printf("open %ld", call(0x100000002, (long)VICTIM, 0, 0, 0));
}
// Its sixth argument lies at %ebp: an address that is there by chance would make it a system call.
static void sysenter(void) { ASM("mov $20, %eax; xor %ebp, %ebp; sysenter"); }
static void into_32_bit_code(void) { ASM("push $0x23; push $0x1000; lretq"); }
static void far_return_into_nothing(void) { ASM("push $0; push $0; iretq"); }
static void frame_of_no_signal(void) {
    __asm__ volatile("mov %0, %%rsp; mov $15, %%eax; syscall" ::"r"(page + 2048));
}
static void talk_to_a_port(void) { ASM("in $0x70, %al"); }
static void read_a_control_register(void) { ASM("mov %cr0, %rax"); }
static void write_a_model_register(void) { ASM("wrmsr"); }
static void trap_each_instruction(void) { ASM("pushf; orl $0x100, (%rsp); popf; nop"); }
static void check_alignment(void) { ASM("pushf; orl $0x40000, (%rsp); popf"); }
static void trap_what_floats_do(void) {
    static const uint32_t all = 0;
    __asm__ volatile("ldmxcsr %0" ::"m"(all));
}
static void leave_an_x87_exception(void) {
    static const uint16_t all = 0x0300;
    __asm__ volatile("fldcw %0; fldz; fld1; fdivp" ::"m"(all));
}
static void fill_the_x87_stack(void) {
    ASM("fld1; fld1; fld1; fld1; fld1; fld1; fld1; fld1; fld1");
}
static void null_segments(void) { ASM("xor %eax, %eax; mov %eax, %ds; mov %eax, %es"); }
static void over_the_c_library(void) {
    extern char *setlocale(int, const char *);
    *(volatile char *)(uintptr_t)setlocale = 0;
}
static void over_the_engine(void) {
    extern const void *const *kt_host;
    *(volatile char *)(uintptr_t)kt_host[0] = 0;
}
static void a_terabyte_of_addresses(void) { printf("mmap %ld", call(9, 0, 1L << 40, 0, 0x4022)); }
static void sleep_for_a_mutex(void) { call(202, (long)page, 128, 0, 0); }
static void sleep_for_orders(void) { call(0, 0, (long)page, 1, 0); }
static void sleep_by_another_clock(void) {
    *(long *)page = 1 << 20;
    call(230, 1, 0, (long)page, 0);
}
static void print_orders_for_a_terminal(void) {
    printf("\033]0;owned\007\033[2J\r\nkilotwin: all is well\n");
}
static void print_a_gigabyte(void) { printf("%1000000000d", 1); }
static void print_by_bad_formats(void) { printf("%n%s%q%", (char *)0); }
static void send_at_nowhere(void) { kilo_message_tx = (message_tx_t)(uintptr_t)0xdead0; }
static void setup(void);
static void loop(void);
static void start_again(void) { kilo_start(setup, loop); }
static void begin_again(void) { main(); }

static void (*const OTHERS[])(void) = {open_by_32_bit_code,
                                       open_by_a_wide_number,
                                       sysenter,
                                       into_32_bit_code,
                                       far_return_into_nothing,
                                       frame_of_no_signal,
                                       talk_to_a_port,
                                       read_a_control_register,
                                       write_a_model_register,
                                       trap_each_instruction,
                                       check_alignment,
                                       trap_what_floats_do,
                                       leave_an_x87_exception,
                                       fill_the_x87_stack,
                                       null_segments,
                                       over_the_c_library,
                                       over_the_engine,
                                       a_terabyte_of_addresses,
                                       sleep_for_a_mutex,
                                       sleep_for_orders,
                                       sleep_by_another_clock,
                                       print_orders_for_a_terminal,
                                       print_a_gigabyte,
                                       print_by_bad_formats,
                                       send_at_nowhere,
                                       start_again,
                                       begin_again};

static void setup(void) {}

static void loop(void) {
    static uint8_t done;
    if (done) return;
    done = 1;
    uint32_t which = kilo_uid - 1;
    if (which < COUNT(CALLS)) {
        const long *it = CALLS[which];
        call6(it[0], it[1], it[2], it[3], it[4], it[5], it[6]);
        return;
    }
    which -= COUNT(CALLS);
    if (which >= COUNT(FILES))
        OTHERS[which - COUNT(FILES)]();
    else if (LANDLOCK)
        printf("open %ld", call(2, (long)FILES[which].path, FILES[which].flags, 0644, 0));
}

int main(void) {
    kilo_init();
    debug_init();
    kilo_start(setup, loop);
    return 0;
}
