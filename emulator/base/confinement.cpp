#include "base/confinement.h"

#include <sys/prctl.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/landlock.h"
#include "base/system_call_filter.h"

namespace kilotwin {

namespace {

constexpr const char *NO_LANDLOCK =
    "this kernel has no Landlock: files of the user can be read and written";
constexpr const char *NO_SECCOMP =
    "this kernel has no seccomp filters: programs can make any system call";

// Addresses for files that are mapped, as tables are that a run writes anew; what is only read
// takes memory of the kernel, a 512th.
constexpr uint64_t FILES_BYTES = uint64_t{64} << 30;

void check(bool done, const char *what) {
    if (!done) throw EngineError(std::string("cannot confine: ") + what + ": " + strerror(errno));
}

/// A confined worker that has yet to load its guests.
struct Loader {
    uint64_t memory_bytes;
    bool sockets, loads_later, forks;
    std::ifstream status;  ///< opened before Landlock shuts it, as is the group
    std::ofstream group;
};
std::optional<Loader> loader;

/// Memory of this process now, in bytes.
struct MemoryNow {
    uint64_t addresses = 0, own = 0;  ///< as RLIMIT_AS and RLIMIT_DATA count it
};

MemoryNow memory_now(std::ifstream &status) {
    MemoryNow now;
    const auto read = [](const std::string &line) { return std::stoull(line.substr(7)) * 1024; };
    for (std::string line; std::getline(status, line);) {
        if (line.starts_with("VmSize:")) now.addresses = read(line);
        if (line.starts_with("VmData:")) now.own = read(line);
    }
    return now;
}

void limit(int what, uint64_t most) {
    rlimit now = {};
    check(getrlimit(static_cast<__rlimit_resource>(what), &now) == 0, "getrlimit");
    now.rlim_cur = now.rlim_max = std::min<rlim_t>(most, now.rlim_max);
    check(setrlimit(static_cast<__rlimit_resource>(what), &now) == 0, "setrlimit");
}

std::vector<std::string> confine(const Confinement &wanted, const SystemCallFilter &filter) {
    check(prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0, "PR_SET_NO_NEW_PRIVS");
    limit(RLIMIT_CORE, 0);
    if (wanted.file_bytes > 0) limit(RLIMIT_FSIZE, wanted.file_bytes);
    const auto missing = lacking_layers();
    if (landlock_version() > 0)
        landlock_restrict(wanted.readable, wanted.executable, wanted.writable);
    if (SystemCallFilter::is_there()) filter.install();
    return missing;
}

}  // namespace

std::vector<std::string> confine_worker(const Confinement &wanted) {
    loader = {wanted.memory_bytes,
              wanted.sockets,
              wanted.loads_later,
              wanted.forks,
              std::ifstream("/proc/self/status"),
              {}};
    if (!wanted.memory_group.empty()) loader->group.open(wanted.memory_group);
    return confine(wanted, SystemCallFilter::of_loader(wanted.sockets, wanted.forks));
}

void close_worker() {
    if (!loader || loader->loads_later) return;
    Loader last = *std::exchange(loader, std::nullopt);
    if (last.memory_bytes > 0) {
        const MemoryNow now = memory_now(last.status);
        limit(RLIMIT_AS, now.addresses + last.memory_bytes + FILES_BYTES);
        limit(RLIMIT_DATA, now.own + last.memory_bytes);
    }
    if (last.group.is_open()) last.group << "0" << std::flush;
    if (SystemCallFilter::is_there())
        SystemCallFilter::of_worker(last.sockets, last.forks).install();
}

void end_loading() {
    if (loader) loader->loads_later = false;
}

std::vector<std::string> confine_compiler(const Confinement &wanted) {
    limit(RLIMIT_AS, COMPILER_MEMORY_BYTES);
    limit(RLIMIT_CPU, COMPILER_CPU_S);
    limit(RLIMIT_FSIZE, COMPILER_FILE_BYTES);
    return confine(wanted, SystemCallFilter::of_compiler());
}

std::vector<std::string> lacking_layers() {
    std::vector<std::string> missing;
    if (landlock_version() == 0) missing.emplace_back(NO_LANDLOCK);
    if (!SystemCallFilter::is_there()) missing.emplace_back(NO_SECCOMP);
    return missing;
}

}  // namespace kilotwin
