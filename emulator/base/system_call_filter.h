/// A seccomp filter: which system calls a process may still make (seccomp(2)).
#ifndef KILOTWIN_BASE_SYSTEM_CALL_FILTER_H
#define KILOTWIN_BASE_SYSTEM_CALL_FILTER_H

#include <linux/filter.h>

#include <cstdint>
#include <vector>

namespace kilotwin {

/// Programs of the kernel's filter machine for x86-64. Calls that are not allowed raise SIGSYS, so
/// that a handler decides (guest/stack.h), as do those of 32-bit code.
class SystemCallFilter {
  public:
    /// An allow-list for a worker: memory, files that it may open, time, its own end. No memory
    /// that can be executed, no process or thread, no signal to others, no change of what signals
    /// do; connections only by `sockets` that are there.
    static SystemCallFilter of_worker(bool sockets);

    /// The same for a worker that has yet to load its guests: it maps code of files, opens ports if
    /// it may have sockets, limits its memory, and installs a further filter.
    static SystemCallFilter of_loader(bool sockets);

    /// A refuse-list for a compiler and what it starts: the network, and other processes.
    static SystemCallFilter of_compiler();

    static bool is_there();

    /// Installs it for all threads of this process. Needs no_new_privs. EngineError if refused.
    void install() const;

  private:
    void begin();
    void allow_work(bool sockets);
    void answer(int number, uint32_t answer);
    void allow_if(int number, unsigned argument, uint32_t mask, uint32_t value);

    std::vector<sock_filter> program_;
};

}  // namespace kilotwin

#endif
