#include "base/parent_death.h"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>

#include "base/errors.h"

namespace kilotwin {

namespace {

void must(bool done, const char *what) {
    if (!done) throw EngineError(std::string(what) + ": " + std::strerror(errno));
}

void sleep_s(double for_s) {
    double whole_s = 0;
    timespec left = {};
    left.tv_nsec = static_cast<long>(std::modf(for_s, &whole_s) * 1e9);
    left.tv_sec = static_cast<time_t>(whole_s);
    while (nanosleep(&left, &left) != 0 && errno == EINTR) continue;
}

/// The guardian of its parent, the worker: kills that some time after the process behind `parent`
/// has ended. It ends with the worker.
[[noreturn]] void guard(pid_t worker, int parent, double grace_s) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != worker) _exit(0);
    // The worker's pipes are closed with the worker.
    pollfd ended = {dup2(parent, 0), POLLIN, 0};
    syscall(SYS_close_range, 1, ~0U, 0);
    while (poll(&ended, 1, -1) < 0 && errno == EINTR) continue;
    sleep_s(grace_s);
    kill(worker, SIGKILL);
    _exit(0);
}

}  // namespace

void end_with_parent(int parent, double grace_s) {
    const pid_t worker = getpid();
    int handle = -1;
    if (grace_s == 0)
        must(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "PR_SET_PDEATHSIG");
    else
        handle = static_cast<int>(syscall(SYS_pidfd_open, parent, 0));
    // A parent that ended before sends nothing any more.
    if (getppid() != parent) _exit(1);
    if (grace_s == 0) return;
    must(handle >= 0, "pidfd_open");
    const pid_t guardian = fork();
    must(guardian >= 0, "fork");
    if (guardian == 0) guard(worker, handle, grace_s);
    close(handle);
}

}  // namespace kilotwin
