#include "base/system_call_filter.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/prctl.h>
#include <linux/sched.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>

#include "base/confinement.h"
#include "base/errors.h"

namespace kilotwin {

namespace {

constexpr uint32_t ALLOW = SECCOMP_RET_ALLOW, TRAP = SECCOMP_RET_TRAP;
constexpr uint32_t WHOLE = ~0u;
constexpr uint32_t X32_BIT = 0x40000000;

constexpr int WORKER[] = {
    // what is open
    SYS_read, SYS_write, SYS_readv, SYS_writev, SYS_pread64, SYS_pwrite64, SYS_lseek, SYS_close,
    SYS_dup, SYS_fsync, SYS_fdatasync, SYS_ftruncate, SYS_fadvise64, SYS_poll, SYS_select,
    SYS_epoll_wait, SYS_epoll_ctl, SYS_copy_file_range, SYS_sendfile, SYS_flock,
    // files, of which Landlock leaves some
    SYS_open, SYS_openat, SYS_stat, SYS_fstat, SYS_lstat, SYS_newfstatat, SYS_statx, SYS_access,
    SYS_faccessat, SYS_faccessat2, SYS_readlink, SYS_readlinkat, SYS_getdents64, SYS_getcwd,
    SYS_rename, SYS_renameat, SYS_renameat2, SYS_unlink, SYS_unlinkat, SYS_rmdir, SYS_mkdir,
    SYS_mkdirat, SYS_statfs, SYS_fstatfs,
    // memory
    SYS_munmap, SYS_mremap, SYS_brk, SYS_madvise, SYS_mincore, SYS_msync,
    // time, and what libc does for threads
    SYS_clock_gettime, SYS_clock_getres, SYS_clock_nanosleep, SYS_nanosleep, SYS_gettimeofday,
    SYS_time, SYS_times, SYS_futex, SYS_set_robust_list, SYS_rseq, SYS_set_tid_address,
    SYS_sched_yield, SYS_sched_getaffinity, SYS_sched_getparam, SYS_sched_getscheduler, SYS_getcpu,
    SYS_membarrier, SYS_rt_sigreturn, SYS_restart_syscall,
    // what it is
    SYS_getpid, SYS_getppid, SYS_gettid, SYS_getuid, SYS_geteuid, SYS_getgid, SYS_getegid,
    SYS_getrusage, SYS_getrlimit, SYS_uname, SYS_sysinfo, SYS_getrandom,
    // its end
    SYS_exit, SYS_exit_group};

// While guests are loaded, in copies too: the limit of memory, the filter that ends it, and threads
// that step robots, each with its signal stack and its timer.
constexpr int WHILE_LOADING[] = {SYS_prlimit64,   SYS_seccomp,      SYS_memfd_create,
                                 SYS_clone,       SYS_clone3,       SYS_rt_sigprocmask,
                                 SYS_sigaltstack, SYS_timer_create, SYS_timer_settime};

// While guests are loaded, a debugger's port is opened.
constexpr int NEW_SOCKETS[] = {SYS_socket, SYS_bind, SYS_listen};

constexpr int OPEN_SOCKETS[] = {
    SYS_accept, SYS_accept4, SYS_recvfrom, SYS_recvmsg, SYS_shutdown, SYS_getsockopt,
    SYS_setsockopt, SYS_getsockname, SYS_getpeername,
    // The bridge's thread ends with signals blocked, and would be killed by SIGSYS.
    SYS_rt_sigprocmask};

// Commands of fcntl() that are left; F_SETOWN, F_SETSIG and F_SETPIPE_SZ are not.
constexpr uint32_t FILE_COMMANDS[] = {F_DUPFD, F_DUPFD_CLOEXEC, F_GETFD, F_SETFD, F_GETFL};

constexpr uint32_t ASKS[] = {TCGETS, FIONREAD, FIONBIO, FIOCLEX, FIONCLEX, TIOCGWINSZ, TIOCGPTN};

// Calls refused to a compiler: connections, other processes, and what changes the system.
constexpr int OF_OTHERS[] = {SYS_socket,
                             SYS_connect,
                             SYS_bind,
                             SYS_listen,
                             SYS_ptrace,
                             SYS_process_vm_readv,
                             SYS_process_vm_writev,
                             SYS_kill,
                             SYS_tkill,
                             SYS_pidfd_send_signal,
                             SYS_mount,
                             SYS_umount2,
                             SYS_pivot_root,
                             SYS_chroot,
                             SYS_setns,
                             SYS_unshare,
                             SYS_bpf,
                             SYS_keyctl,
                             SYS_add_key,
                             SYS_io_uring_setup,
                             SYS_init_module,
                             SYS_finit_module,
                             SYS_kexec_load,
                             SYS_reboot,
                             SYS_perf_event_open,
                             SYS_userfaultfd};

constexpr sock_filter load(size_t offset) {
    return BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<uint32_t>(offset));
}
constexpr sock_filter give(uint32_t answer) { return BPF_STMT(BPF_RET | BPF_K, answer); }
/// Passes over `many` instructions unless the loaded word is `value`.
constexpr sock_filter unless(uint32_t value, uint8_t many) {
    return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, many);
}

}  // namespace

void SystemCallFilter::begin() {
    program_ = {load(offsetof(seccomp_data, arch)),
                unless(AUDIT_ARCH_X86_64, 1),
                BPF_JUMP(BPF_JMP | BPF_JA, 1, 0, 0),
                give(TRAP),
                load(offsetof(seccomp_data, nr)),
                BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, X32_BIT, 0, 1),
                give(TRAP)};
}

void SystemCallFilter::answer(int number, uint32_t answer) {
    program_.insert(program_.end(), {unless(static_cast<uint32_t>(number), 1), give(answer)});
}

/// Allows a call whose arguments are as said, all of them. The number of the call is loaded again
/// behind it.
void SystemCallFilter::allow_if(int number, std::initializer_list<Argument> wanted) {
    constexpr size_t BYTES_EACH = 8, STEPS_EACH = 3;
    const auto steps = static_cast<uint8_t>(STEPS_EACH * wanted.size() + 2);
    program_.push_back(unless(static_cast<uint32_t>(number), steps));
    uint8_t left = steps;
    for (const Argument &each : wanted) {
        left -= STEPS_EACH;
        const size_t at = offsetof(seccomp_data, args) + BYTES_EACH * each.number;
        const size_t half = each.high ? sizeof(uint32_t) : 0;
        program_.insert(program_.end(),
                        {load(at + half), BPF_STMT(BPF_ALU | BPF_AND | BPF_K, each.mask),
                         unless(each.value, static_cast<uint8_t>(left - 1))});
    }
    program_.insert(program_.end(), {give(ALLOW), load(offsetof(seccomp_data, nr))});
}

/// The common part of both filters of a worker.
void SystemCallFilter::allow_work(bool sockets, bool forks) {
    begin();
    for (const int number : WORKER) answer(number, ALLOW);
    if (sockets)
        for (const int number : OPEN_SOCKETS) answer(number, ALLOW);
    // A send names no address: it reaches the other end of a connection alone, also by UDP.
    if (sockets) allow_if(SYS_sendto, {{4, WHOLE, 0}, {4, WHOLE, 0, true}});
    if (forks) {
        // As fork() calls it: no thread, and no namespace.
        constexpr uint32_t AS_FORK = CLONE_CHILD_CLEARTID | CLONE_CHILD_SETTID | SIGCHLD;
        allow_if(SYS_clone, {{0, WHOLE, AS_FORK}, {0, WHOLE, 0, true}});
        answer(SYS_rt_sigprocmask, ALLOW);
        answer(SYS_pipe2, ALLOW);  // Arrow's, which it makes anew at a fork
    }
    // Private memory, which is counted.
    allow_if(SYS_mmap, {{2, PROT_EXEC, 0}, {3, MAP_SHARED | MAP_GROWSDOWN, 0}});
    allow_if(SYS_mprotect, {{2, PROT_EXEC, 0}});
    for (const uint32_t command : FILE_COMMANDS) allow_if(SYS_fcntl, {{1, WHOLE, command}});
    allow_if(SYS_fcntl, {{1, WHOLE, F_SETFL}, {2, O_ASYNC, 0}});
    for (const uint32_t ask : ASKS) allow_if(SYS_ioctl, {{1, WHOLE, ask}});
    // Waits that no signal mask prolongs.
    allow_if(SYS_ppoll, {{3, WHOLE, 0}, {3, WHOLE, 0, true}});
    allow_if(SYS_pselect6, {{5, WHOLE, 0}, {5, WHOLE, 0, true}});
    allow_if(SYS_epoll_pwait, {{4, WHOLE, 0}, {4, WHOLE, 0, true}});
    allow_if(SYS_tgkill, {{0, WHOLE, static_cast<uint32_t>(getpid())}, {2, WHOLE, SIGABRT}});
    allow_if(SYS_prlimit64, {{2, WHOLE, 0}, {2, WHOLE, 0, true}});  // to look, not to change
    allow_if(SYS_prctl, {{0, WHOLE, PR_SET_NAME}});
    allow_if(SYS_prctl, {{0, WHOLE, PR_SET_VMA}});
}

SystemCallFilter SystemCallFilter::of_loader(bool sockets, bool forks) {
    SystemCallFilter filter;
    filter.allow_work(sockets, forks);
    for (const int number : WHILE_LOADING) filter.answer(number, ALLOW);
    if (sockets)
        for (const int number : NEW_SOCKETS) filter.answer(number, ALLOW);
    filter.allow_if(SYS_mmap, {{3, MAP_ANONYMOUS, 0}});  // code of files
    filter.program_.push_back(give(TRAP));
    return filter;
}

SystemCallFilter SystemCallFilter::of_worker(bool sockets, bool forks) {
    SystemCallFilter filter;
    filter.allow_work(sockets, forks);
    filter.program_.push_back(give(TRAP));
    return filter;
}

SystemCallFilter SystemCallFilter::of_compiler() {
    SystemCallFilter filter;
    filter.begin();
    for (const int number : OF_OTHERS) filter.answer(number, SECCOMP_RET_ERRNO | EPERM);
    filter.program_.push_back(give(ALLOW));
    return filter;
}

bool SystemCallFilter::is_there() {
    uint32_t action = TRAP;
    return syscall(SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &action) == 0;
}

void SystemCallFilter::install() const {
    const sock_fprog program = {static_cast<unsigned short>(program_.size()),
                                const_cast<sock_filter *>(program_.data())};
    const unsigned flags = SECCOMP_FILTER_FLAG_TSYNC;
    if (syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, flags, &program) != 0)
        throw EngineError(std::string("cannot confine: seccomp: ") + std::strerror(errno));
}

std::string system_call_name(int number) {
    struct Named {
        int number;
        const char *name;
    };
    static constexpr Named NAMED[] = {{SYS_fork, "fork()"},
                                      {SYS_vfork, "vfork()"},
                                      {SYS_clone, "clone()"},
                                      {SYS_execve, "execve()"},
                                      {SYS_execveat, "execveat()"},
                                      {SYS_kill, "kill()"},
                                      {SYS_tkill, "tkill()"},
                                      {SYS_tgkill, "tgkill()"},
                                      {SYS_socket, "socket()"},
                                      {SYS_connect, "connect()"},
                                      {SYS_bind, "bind()"},
                                      {SYS_ptrace, "ptrace()"},
                                      {SYS_mmap, "mmap()"},
                                      {SYS_mprotect, "mprotect()"},
                                      {SYS_rt_sigaction, "sigaction()"},
                                      {SYS_setitimer, "setitimer()"},
                                      {SYS_alarm, "alarm()"},
                                      {SYS_pause, "pause()"},
                                      {SYS_prctl, "prctl()"},
                                      {SYS_chdir, "chdir()"},
                                      {SYS_setuid, "setuid()"},
                                      {SYS_symlink, "symlink()"},
                                      {SYS_link, "link()"},
                                      {SYS_chmod, "chmod()"},
                                      {SYS_prlimit64, "setrlimit()"},
                                      {SYS_setrlimit, "setrlimit()"},
                                      {SYS_wait4, "wait()"},
                                      {SYS_ioctl, "ioctl()"},
                                      {SYS_fcntl, "fcntl()"},
                                      {SYS_fallocate, "fallocate()"},
                                      {SYS_pipe2, "pipe()"},
                                      {SYS_eventfd2, "eventfd()"},
                                      {SYS_ppoll, "ppoll()"},
                                      {SYS_pselect6, "pselect()"},
                                      {SYS_epoll_pwait, "epoll_pwait()"},
                                      {SYS_io_uring_setup, "io_uring_setup()"},
                                      {SYS_memfd_create, "memfd_create()"},
                                      {SYS_process_vm_writev, "process_vm_writev()"}};
    for (const auto &named : NAMED)
        if (named.number == number) return named.name;
    return "system call " + std::to_string(number);
}

}  // namespace kilotwin
