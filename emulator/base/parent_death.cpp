#include "base/parent_death.h"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
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

int handle_of(pid_t process) { return static_cast<int>(syscall(SYS_pidfd_open, process, 0)); }

double now_s() {
    timespec now = {};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Waits until one of the processes behind `handles` has ended, but not beyond `end_s`.
template <size_t N> void await(std::array<pollfd, N> &handles, double end_s) {
    for (;;) {
        const double left_ms = std::ceil(1e3 * (end_s - now_s()));
        const int most_ms = std::isfinite(left_ms) ? std::max(0, static_cast<int>(left_ms)) : -1;
        if (poll(handles.data(), handles.size(), most_ms) >= 0 || errno != EINTR) return;
    }
}

void close_all_but(std::array<int, 2> kept) {
    std::sort(kept.begin(), kept.end());
    unsigned first = 0;
    for (const int handle : kept) {
        const auto next = static_cast<unsigned>(handle);
        if (next > first) syscall(SYS_close_range, first, next - 1, 0);
        first = next + 1;
    }
    syscall(SYS_close_range, first, ~0U, 0);
}

/// The guardian of `worker`, its parent: kills it `grace_s` seconds after the process behind
/// `parent` has ended. Ends with the worker, which it watches itself: a worker that Landlock
/// confines sends no signal at its end (PR_SET_PDEATHSIG).
[[noreturn]] void guard(pid_t worker, int parent, double grace_s) {
    const int own = handle_of(worker);
    if (getppid() != worker || own < 0) _exit(0);
    close_all_but({parent, own});  // the worker's pipes are closed with the worker
    std::array<pollfd, 2> both = {{{own, POLLIN, 0}, {parent, POLLIN, 0}}};
    await(both, INFINITY);
    std::array<pollfd, 1> one = {{{own, POLLIN, 0}}};
    await(one, now_s() + grace_s);
    if (one[0].revents == 0) syscall(SYS_pidfd_send_signal, own, SIGKILL, nullptr, 0);
    _exit(0);
}

}  // namespace

void end_with_parent(int parent, double grace_s) {
    const pid_t worker = getpid();
    int handle = -1;
    if (grace_s == 0)
        must(prctl(PR_SET_PDEATHSIG, SIGKILL) == 0, "PR_SET_PDEATHSIG");
    else
        handle = handle_of(parent);
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
