#include "base/landlock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "base/errors.h"

namespace kilotwin {

namespace {

// The numbers are the kernel's interface (linux/landlock.h); headers of older systems lack some.
constexpr uint64_t EXECUTE = 1 << 0, WRITE_FILE = 1 << 1, READ_FILE = 1 << 2, READ_DIR = 1 << 3,
                   REMOVE_DIR = 1 << 4, REMOVE_FILE = 1 << 5, MAKE_DIR = 1 << 7, MAKE_REG = 1 << 8,
                   REFER = 1 << 13, TRUNCATE = 1 << 14;
constexpr uint64_t OF_FILES = EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE;
constexpr uint64_t READING = READ_FILE | READ_DIR;
constexpr uint64_t WRITING =
    READING | WRITE_FILE | TRUNCATE | REMOVE_DIR | REMOVE_FILE | MAKE_DIR | MAKE_REG | REFER;
// All that a version can refuse: the first 13 rights, then one each with versions 2, 3 and 5.
constexpr uint64_t ALL_OF[] = {
    0, (1 << 13) - 1, (1 << 14) - 1, (1 << 15) - 1, (1 << 15) - 1, (1 << 16) - 1};
constexpr int NEWEST_KNOWN = 5;
constexpr uint32_t GET_VERSION = 1, PATH_BENEATH = 1;

// From version 6 on: signals, and abstract sockets, reach no process outside.
constexpr uint64_t SCOPES = 3;
constexpr int HAS_SCOPES = 6;

struct Ruleset {
    uint64_t handled_files, handled_network, scopes;
};
struct __attribute__((packed)) PathBeneath {
    uint64_t allowed;
    int32_t parent;
};

void fail(const std::string &what) {
    throw EngineError("cannot confine: Landlock: " + what + ": " + std::strerror(errno));
}

void allow(int ruleset, const std::vector<std::string> &paths, uint64_t rights) {
    for (const auto &path : paths) {
        const int place = open(path.c_str(), O_PATH | O_CLOEXEC);
        if (place < 0) continue;
        struct stat kind = {};
        fstat(place, &kind);
        const PathBeneath rule = {S_ISDIR(kind.st_mode) ? rights : rights & OF_FILES, place};
        const bool done = syscall(SYS_landlock_add_rule, ruleset, PATH_BENEATH, &rule, 0) == 0;
        close(place);
        if (!done) fail(path);
    }
}

}  // namespace

int landlock_version() {
    if (std::getenv("KILOTWIN_WITHOUT_LANDLOCK") != nullptr) return 0;
    const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, GET_VERSION);
    return version < 0 ? 0 : static_cast<int>(version);
}

void landlock_restrict(const std::vector<std::string> &readable,
                       const std::vector<std::string> &executable,
                       const std::vector<std::string> &writable) {
    const uint64_t handled = ALL_OF[std::min(landlock_version(), NEWEST_KNOWN)];
    const bool has_scopes = landlock_version() >= HAS_SCOPES;
    const Ruleset rules = {handled, 0, SCOPES};
    const int ruleset =
        static_cast<int>(syscall(SYS_landlock_create_ruleset, &rules,
                                 has_scopes ? sizeof rules : sizeof rules.handled_files, 0));
    if (ruleset < 0) fail("no rules");
    allow(ruleset, readable, handled & READING);
    allow(ruleset, executable, handled & (READING | EXECUTE));
    allow(ruleset, writable, handled & WRITING);
    const bool done = syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
    close(ruleset);
    if (!done) fail("the rules are refused");
}

}  // namespace kilotwin
