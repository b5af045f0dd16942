/// A seccomp filter: which system calls a process may still make (seccomp(2)).
#ifndef KILOTWIN_BASE_SYSTEM_CALL_FILTER_H
#define KILOTWIN_BASE_SYSTEM_CALL_FILTER_H

#include <linux/filter.h>

#include <cstdint>
#include <initializer_list>
#include <vector>

namespace kilotwin {

/// Programs of the kernel's filter machine for x86-64. Calls that are not allowed raise SIGSYS, so
/// that a handler decides (robots/native/stack.h), as do those of 32-bit code.
///
/// The kernel asks every filter that a process has, and takes the strictest answer: what one has
/// refused no later one can allow. A filter sees the numbers that a call is made with, and not
/// what they point to: so a wait is allowed without a signal mask, and not with certain ones.
class SystemCallFilter {
  public:
    /// An allow-list for a worker: memory, files that it may open, time, its own end. No memory
    /// that can be executed or that is shared, no process or thread, no signal but abort()'s, no
    /// change of what signals do, no pipes; connections only by `sockets` that are there, processes
    /// only as `forks` of it.
    static SystemCallFilter of_worker(bool sockets, bool forks);

    /// The same for a worker that has yet to load its guests: it maps code of files and of memory,
    /// starts the threads that run guests, opens ports if it may have sockets, limits its memory,
    /// and installs a further filter.
    static SystemCallFilter of_loader(bool sockets, bool forks);

    /// A refuse-list for a compiler and what it starts: the network, and other processes.
    static SystemCallFilter of_compiler();

    static bool is_there();

    /// Installs it for all threads of this process. Needs no_new_privs. EngineError if refused.
    void install() const;

  private:
    /// Refuses code of other machines, and leaves the number of the call loaded.
    void begin();
    /// Allows what a worker needs at all times.
    void allow_work(bool sockets, bool forks);
    /// The kernel's answer to a call, whatever its arguments are.
    void answer(int number, uint32_t answer);

    /// Half of an argument: the lower one, or `high`; masked, it has to have the value.
    struct Argument {
        unsigned number;
        uint32_t mask, value;
        bool high = false;
    };
    /// Allows a call all of whose arguments are so.
    void allow_if(int number, std::initializer_list<Argument> wanted);

    std::vector<sock_filter> program_;
};

}  // namespace kilotwin

#endif
