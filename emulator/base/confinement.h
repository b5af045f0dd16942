/// Confinement of a process by the kernel: for workers, in which programs of robots run, and for
/// the compiler that builds those.
///
/// Four layers, each as far as the kernel has it: no new privileges; limits of memory and of
/// files; Landlock, which leaves the named files and folders; seccomp, which leaves named system
/// calls. None of them can be taken back, and children have them too.
#ifndef KILOTWIN_BASE_CONFINEMENT_H
#define KILOTWIN_BASE_CONFINEMENT_H

#include <cstdint>
#include <string>
#include <vector>

namespace kilotwin {

/// Rights of a confined process beside computing and what it has open. Paths that do not exist are
/// passed over; of folders it is all that lies below.
struct Confinement {
    std::vector<std::string> readable;
    std::vector<std::string> executable;  ///< readable too
    std::vector<std::string> writable;    ///< readable too; files may be made and removed there
    /// Memory beyond what it has when it is closed, and size of a file, bytes; 0: no limit.
    uint64_t memory_bytes = 0, file_bytes = 0;
    /// A cgroup's cgroup.procs, by which it joins when it is closed; "": none.
    std::string memory_group = {};
    /// Takes connections, sends and receives by sockets that it has open.
    bool sockets = false;
    /// close_worker() waits for end_loading(): of a worker that runs no native guest, and maps
    /// faster code of its translations when that is there.
    bool loads_later = false;
    /// It may fork, as a debugger's world does; its forks are confined as it is.
    bool forks = false;
};

/// More than our largest programs take several times over.
constexpr uint64_t COMPILER_MEMORY_BYTES = uint64_t{3} << 30, COMPILER_FILE_BYTES = 1 << 28,
                   COMPILER_CPU_S = 300;

/// Confines this process, which must have one thread: threads that it has already keep their files.
/// A system call that is not left fails with EPERM; made by a guest it ends the guest's call
/// (robots/native/stack.h). Guests are loaded behind it, so it still maps code of files that it may
/// read, until close_worker(). Takes some milliseconds. Returns the layers that the kernel lacks,
/// each as a clause; empty: all is as said. EngineError if the kernel has a layer and refuses it.
std::vector<std::string> confine_worker(const Confinement &wanted);

/// Takes what a confined worker has for loading guests alone, and limits its memory; called before
/// the first guest runs (robots/native/stack.h). Nothing happens where it is not confined, or
/// closed.
void close_worker();

/// Nothing is loaded any more: the next close_worker() closes.
void end_loading();

/// The same for a process that is about to execute a compiler: it may start programs, and is not
/// kept from system calls but those that reach other processes or the network. Each process of it
/// has COMPILER_MEMORY_BYTES and COMPILER_CPU_S, and makes files of COMPILER_FILE_BYTES at most.
std::vector<std::string> confine_compiler(const Confinement &wanted);

/// The layers that this kernel lacks, without confining anything.
std::vector<std::string> lacking_layers();

/// Name of a system call for messages: "fork()", or "system call 999".
std::string system_call_name(int number);

}  // namespace kilotwin

#endif
