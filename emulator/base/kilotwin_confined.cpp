// kilotwin_confined --read PATH --execute PATH --write PATH ... -- COMMAND ...
//
// Confines itself (base/confinement.h) to these files and folders, each option repeatable, and
// executes the command. With --require also where the kernel lacks a layer: then it exits with 125,
// as it does when it cannot start the command.
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>

#include "base/confinement.h"
#include "base/errors.h"
#include "base/parent_death.h"

namespace {

constexpr int CANNOT_START = 125;

int refuse(const char *why) {
    std::fprintf(stderr, "kilotwin_confined: %s\n", why);
    return CANNOT_START;
}

}  // namespace

int main(int count, char **words) {
    const int parent = getppid();
    kilotwin::Confinement left;
    bool require = false;
    int at = 1;
    for (; at < count && std::string_view(words[at]) != "--"; at++) {
        const std::string_view option = words[at];
        if (option == "--require") {
            require = true;
            continue;
        }
        if (at + 1 == count) return refuse("an option lacks its path");
        const char *path = words[++at];
        if (option == "--read")
            left.readable.emplace_back(path);
        else if (option == "--execute")
            left.executable.emplace_back(path);
        else if (option == "--write")
            left.writable.emplace_back(path);
        else
            return refuse("an option that it does not have");
    }
    if (at + 1 >= count) return refuse("no command behind --");
    try {
        kilotwin::end_with_parent(parent, 0);
        const auto missing = kilotwin::confine_compiler(left);
        if (require && !missing.empty()) return refuse(missing.front().c_str());
    } catch (const kilotwin::EngineError &error) {
        return refuse(error.what());
    }
    // The command is its purpose. NOLINTNEXTLINE(clang-analyzer-optin.taint.GenericTaint)
    execvp(words[at + 1], words + at + 1);
    return refuse(std::strerror(errno));
}
