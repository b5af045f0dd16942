#include "robots/native/program.h"

#include <dlfcn.h>
#include <link.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <memory>
#include <utility>

#include "base/errors.h"
#include "robots/native/guest_file.h"
#include "robots/native/stack.h"

namespace kilotwin {

namespace {

constexpr uintptr_t PAGE = 4096;

// Whole pages only: the rest of the guard, at most two pages, stays accessible.
void forbid_access(const uint8_t *begin) {
    auto first = (reinterpret_cast<uintptr_t>(begin) + PAGE - 1) / PAGE * PAGE;
    auto last = (reinterpret_cast<uintptr_t>(begin) + KT_GUARD_BYTES) / PAGE * PAGE;
    if (mprotect(reinterpret_cast<void *>(first), last - first, PROT_NONE) != 0)
        throw EngineError(std::string("cannot guard a program's state: ") + std::strerror(errno));
}

/// The loaded object that `address` lies in, with its executable parts made known to the stack.
struct CodeSearch {
    uintptr_t address;

    static int look(dl_phdr_info *info, size_t, void *search) {
        const uintptr_t wanted = static_cast<CodeSearch *>(search)->address;
        const auto parts = info->dlpi_phdr, end = parts + info->dlpi_phnum;
        const auto begin_of = [&](const ElfW(Phdr) & part) {
            return info->dlpi_addr + part.p_vaddr;
        };
        const auto holds = [&](const ElfW(Phdr) & part) {
            return part.p_type == PT_LOAD && wanted - begin_of(part) < part.p_memsz;
        };
        if (std::none_of(parts, end, holds)) return 0;
        for (auto part = parts; part < end; part++)
            if (part->p_type == PT_LOAD && (part->p_flags & PF_X) != 0)
                GuestStack::add_code(begin_of(*part), begin_of(*part) + part->p_memsz,
                                     info->dlpi_addr);
        return 1;
    }
};

}  // namespace

Program &Program::load(const std::string &path, const std::string &name, uint32_t share) {
    static std::map<std::pair<std::string, uint32_t>, std::unique_ptr<Program>> loaded;
    auto &program = loaded[{path, share}];
    if (!program) program.reset(new Program(path, name, share));
    return *program;
}

Program::Program(const std::string &path, std::string name, uint32_t share)
    : name_(std::move(name)),
      path_(path),
      stack_(GuestStack::of(share)) {
    const std::string failure = "program " + name_ + " cannot be loaded";
    void *handle = share == 0 ? load_guest_file(path, failure) : load_guest_copy(path, failure);
    table_ = static_cast<const kt_table_t *>(dlsym(handle, "kt_table"));
    is_covered_ = dlsym(handle, "kt_coverage") != nullptr;
    if (table_ == nullptr)
        throw EngineError(path + " is no native program of Kilotwin: it has no kt_table");
    if (table_->abi != KT_GUEST_ABI)
        throw EngineError(path_ + " was built for another Kilotwin (ABI " +
                          std::to_string(table_->abi) + ", this one has " +
                          std::to_string(KT_GUEST_ABI) + "): build it again");
    state_bytes_ = static_cast<size_t>(table_->state_end - table_->state_begin);
    initial_.assign(table_->state_begin, table_->state_end);
    forbid_access(table_->guard_low);
    forbid_access(table_->guard_high);
    CodeSearch search = {reinterpret_cast<uintptr_t>(table_)};
    dl_iterate_phdr(CodeSearch::look, &search);
    names_period_ = table_->tx_period != nullptr;
    settles_period_ = table_->settled_period != nullptr;
    may_send_ = table_->message_tx != nullptr;
    reads_sensors_ = table_->sensor != nullptr;
}

/// The names lie one after the other, each ended by a zero.
std::string Program::own_handlers() const {
    std::string names;
    for (const char *name = table_->handlers_begin; name < table_->handlers_end;
         name += std::strlen(name) + 1)
        names += (names.empty() ? "" : ", ") + std::string(name);
    return names;
}

// Both copies are needed: the guest has one section, and pointers of its variables lead into it.
void Program::swap_in(uint8_t *image) {
    if (resident_ != nullptr) std::memcpy(resident_, table_->state_begin, state_bytes_);
    std::memcpy(table_->state_begin, image, state_bytes_);
    resident_ = image;
}

std::vector<uint8_t> Program::state_of(const uint8_t *image) const {
    const uint8_t *at = state_at(image);
    return {at, at + state_bytes_};
}

void Program::set_state_of(uint8_t *image, const uint8_t *state) {
    std::memcpy(image == resident_ ? table_->state_begin : image, state, state_bytes_);
}

void Program::copy_state_of(const uint8_t *image, uint8_t *state) const {
    std::memcpy(state, state_at(image), state_bytes_);
}

void Program::evict(const uint8_t *image) {
    if (resident_ != image) return;
    std::memcpy(resident_, table_->state_begin, state_bytes_);
    resident_ = nullptr;
}

bool Program::is_beside_state(const void *address) const {
    // A negative index of 16 or 32 bits, taken as unsigned, is off by 2^16 or 2^32 elements.
    constexpr int64_t RAM_BYTES = 2048, WRAPS[] = {0, int64_t{1} << 16, int64_t{1} << 32};
    const auto way = static_cast<int64_t>(reinterpret_cast<uintptr_t>(address) -
                                          reinterpret_cast<uintptr_t>(table_->state_begin));
    for (const int64_t wrap : WRAPS)
        for (const int64_t element : {1, 2, 4, 8}) {
            const int64_t offset = way - wrap * element;
            if (offset >= -RAM_BYTES && offset < static_cast<int64_t>(state_bytes_) + RAM_BYTES)
                return true;
        }
    return false;
}

/// A guard is left open at its ends, up to whole pages, but counts as a whole.
bool Program::guards(const void *address) const {
    auto at = static_cast<const uint8_t *>(address);
    return (at >= table_->guard_low && at < table_->guard_low + KT_GUARD_BYTES) ||
           (at >= table_->guard_high && at < table_->guard_high + KT_GUARD_BYTES);
}

}  // namespace kilotwin
