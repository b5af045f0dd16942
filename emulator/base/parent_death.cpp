#include "base/parent_death.h"

#include <signal.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>

#include "base/errors.h"

namespace kilotwin {

namespace {

constexpr int PARENT_ENDED = SIGUSR2;

timer_t timer;
bool has_timer = false;
itimerspec grace = {};

// The timer sends SIGKILL, which a program cannot hold off.
void begin_grace(int) { timer_settime(timer, 0, &grace, nullptr); }

void must(bool done, const char *what) {
    if (!done) throw EngineError(std::string(what) + ": " + std::strerror(errno));
}

void prepare_grace(double grace_s) {
    double whole_s = 0;
    grace.it_value.tv_nsec = static_cast<long>(std::modf(grace_s, &whole_s) * 1e9);
    grace.it_value.tv_sec = static_cast<time_t>(whole_s);
    sigevent event = {};
    event.sigev_notify = SIGEV_SIGNAL;
    event.sigev_signo = SIGKILL;
    must(timer_create(CLOCK_MONOTONIC, &event, &timer) == 0, "timer_create");
    has_timer = true;
    struct sigaction action = {};
    action.sa_handler = begin_grace;
    action.sa_flags = SA_RESTART;
    must(sigaction(PARENT_ENDED, &action, nullptr) == 0, "sigaction");
}

}  // namespace

void end_with_parent(int parent, double grace_s) {
    if (grace_s > 0) prepare_grace(grace_s);
    must(prctl(PR_SET_PDEATHSIG, grace_s > 0 ? PARENT_ENDED : SIGKILL) == 0, "PR_SET_PDEATHSIG");
    // A parent that ended before the call above sends nothing any more.
    if (getppid() != parent) _exit(1);
}

// libc hands out the kernel's number where the timer sends a signal.
int grace_timer() { return has_timer ? static_cast<int>(reinterpret_cast<intptr_t>(timer)) : -1; }

}  // namespace kilotwin
