#include "robots/native/guest_file.h"

#include <dlfcn.h>
#include <elf.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "base/errors.h"

namespace kilotwin {

namespace {

// Tags by which the loader finds code, or calls it. IRELATIVE relocations are searched for below.
constexpr int64_t PACKED_RELOCATIONS = 36;  // DT_RELR, which older headers lack
constexpr std::pair<int64_t, const char *> RUN_BY_LOADER[] = {
    {DT_INIT, "an initialiser (_init, section .init)"},
    {DT_FINI, "a finaliser (_fini, section .fini)"},
    {DT_INIT_ARRAY, "initialisers (section .init_array)"},
    {DT_FINI_ARRAY, "finalisers (section .fini_array)"},
    {DT_PREINIT_ARRAY, "initialisers (section .preinit_array)"},
    {DT_AUDIT, "a library that audits"},
    {DT_DEPAUDIT, "a library that audits"},
    {DT_AUXILIARY, "an auxiliary library"},
    {DT_FILTER, "a filter library"},
    {DT_RPATH, "a path of libraries"},
    {DT_RUNPATH, "a path of libraries"},
    {PACKED_RELOCATIONS, "packed relocations"},
    {DT_TEXTREL, "code that is changed when it is loaded"}};
constexpr std::string_view LIBRARIES[] = {"libc.so.6", "libm.so.6"};
constexpr std::string_view EXPORTS[] = {"kt_table", "kt_coverage", "translation",
                                        "translation_coverage"};

/// Throws; `what` is the clause that says what is wrong with the file.
[[noreturn]] void refuse(const std::string &what) { throw EngineError(what); }

/// The bytes of a shared object by their addresses, as the loader would map them.
class Image {
  public:
    explicit Image(std::vector<char> bytes) : bytes_(std::move(bytes)) {
        const auto head = at_offset<Elf64_Ehdr>(0);
        if (std::memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 ||
            head.e_ident[EI_CLASS] != ELFCLASS64 || head.e_type != ET_DYN ||
            head.e_machine != EM_X86_64 || head.e_phentsize != sizeof(Elf64_Phdr))
            refuse("it is damaged");
        for (size_t i = 0; i < head.e_phnum; i++)
            parts.push_back(at_offset<Elf64_Phdr>(head.e_phoff + i * sizeof(Elf64_Phdr)));
    }

    template <typename T> T at(uint64_t address) const {
        for (const auto &part : parts)
            if (part.p_type == PT_LOAD && address >= part.p_vaddr &&
                address - part.p_vaddr < part.p_filesz)
                return at_offset<T>(part.p_offset + (address - part.p_vaddr));
        refuse("it is damaged");
    }

    std::string text(uint64_t address) const {
        std::string text;
        while (const char letter = at<char>(address + text.size())) text += letter;
        return text;
    }

    std::vector<Elf64_Phdr> parts;

  private:
    template <typename T> T at_offset(uint64_t offset) const {
        if (offset > bytes_.size() || bytes_.size() - offset < sizeof(T)) refuse("it is cut off");
        T value;
        std::memcpy(&value, bytes_.data() + offset, sizeof value);
        return value;
    }

    std::vector<char> bytes_;
};

/// The dynamic section: the one value of each tag, but for DT_NEEDED.
struct Dynamic {
    explicit Dynamic(const Image &image) {
        for (const auto &part : image.parts)
            if (part.p_type == PT_DYNAMIC)
                for (uint64_t at = part.p_vaddr;; at += sizeof(Elf64_Dyn)) {
                    const auto entry = image.at<Elf64_Dyn>(at);
                    if (entry.d_tag == DT_NULL) break;
                    entries.push_back(entry);
                }
    }

    const Elf64_Dyn *find(int64_t tag) const {
        // The loader takes the last of several.
        const auto found = std::find_if(entries.rbegin(), entries.rend(),
                                        [tag](const auto &entry) { return entry.d_tag == tag; });
        return found == entries.rend() ? nullptr : &*found;
    }
    uint64_t value(int64_t tag) const {
        const auto *entry = find(tag);
        return entry == nullptr ? 0 : entry->d_un.d_val;
    }

    std::vector<Elf64_Dyn> entries;
};

void look_at_parts(const Image &image) {
    const auto is_stack = [](const auto &part) { return part.p_type == PT_GNU_STACK; };
    const auto stack = std::find_if(image.parts.begin(), image.parts.end(), is_stack);
    // Without such a part the loader takes it for one.
    if (stack == image.parts.end() || (stack->p_flags & PF_X) != 0)
        refuse("it wants a stack that can be executed");
    for (const auto &part : image.parts) {
        if (part.p_type == PT_LOAD && (part.p_flags & PF_W) != 0 && (part.p_flags & PF_X) != 0)
            refuse("it has code that can be written over");
        if (part.p_type == PT_TLS)
            refuse("it has variables of a thread (__thread), which a robot does not have");
    }
}

void look_at_libraries(const Image &image, const Dynamic &dynamic) {
    for (const auto &[tag, what] : RUN_BY_LOADER)
        if (dynamic.find(tag) != nullptr) refuse(std::string("it has ") + what);
    if ((dynamic.value(DT_FLAGS) & DF_TEXTREL) != 0)
        refuse("it has code that is changed when it is loaded");
    for (const auto &entry : dynamic.entries)
        if (entry.d_tag == DT_NEEDED) {
            const auto name = image.text(dynamic.value(DT_STRTAB) + entry.d_un.d_val);
            if (std::find(std::begin(LIBRARIES), std::end(LIBRARIES), name) == std::end(LIBRARIES))
                refuse("it wants the library " + name);
        }
}

constexpr const char *CHOSEN = "it has a function that is chosen when it is loaded (ifunc)";

/// Symbols that it gives others. Returns how many there are, those that it wants among them.
uint32_t look_at_symbols(const Image &image, const Dynamic &dynamic) {
    if (dynamic.find(DT_HASH) == nullptr) refuse("it has no list of its symbols");
    const auto count = image.at<uint32_t>(dynamic.value(DT_HASH) + sizeof(uint32_t));
    for (uint32_t i = 0; i < count; i++) {
        const auto symbol = image.at<Elf64_Sym>(dynamic.value(DT_SYMTAB) + i * sizeof(Elf64_Sym));
        if (symbol.st_shndx == SHN_UNDEF) continue;
        if (ELF64_ST_TYPE(symbol.st_info) == STT_GNU_IFUNC) refuse(CHOSEN);
        if (ELF64_ST_BIND(symbol.st_info) == STB_LOCAL) continue;
        const auto name = image.text(dynamic.value(DT_STRTAB) + symbol.st_name);
        if (std::find(std::begin(EXPORTS), std::end(EXPORTS), name) == std::end(EXPORTS))
            refuse("it defines " + name + " for others");
    }
    return count;
}

void look_at_relocations(const Image &image, uint32_t symbols, uint64_t begin, uint64_t bytes) {
    for (uint64_t at = begin; at < begin + bytes; at += sizeof(Elf64_Rela)) {
        const auto relocation = image.at<Elf64_Rela>(at);
        const auto type = ELF64_R_TYPE(relocation.r_info);
        if (type == R_X86_64_IRELATIVE) refuse(CHOSEN);
        if (type != R_X86_64_RELATIVE && type != R_X86_64_64 && type != R_X86_64_GLOB_DAT &&
            type != R_X86_64_JUMP_SLOT)
            refuse("it has relocations of type " + std::to_string(type));
        const auto holds = [&](const auto &part) {
            return part.p_type == PT_LOAD && (part.p_flags & PF_W) != 0 &&
                   relocation.r_offset >= part.p_vaddr &&
                   relocation.r_offset - part.p_vaddr < part.p_memsz;
        };
        if (ELF64_R_SYM(relocation.r_info) >= symbols ||
            std::none_of(image.parts.begin(), image.parts.end(), holds))
            refuse("it has a relocation that leads out of it");
    }
}

void look_at(const Image &image) {
    const Dynamic dynamic(image);
    look_at_parts(image);
    look_at_libraries(image, dynamic);
    const auto symbols = look_at_symbols(image, dynamic);
    look_at_relocations(image, symbols, dynamic.value(DT_RELA), dynamic.value(DT_RELASZ));
    look_at_relocations(image, symbols, dynamic.value(DT_JMPREL), dynamic.value(DT_PLTRELSZ));
}

/// The bytes of a file that nothing is wrong with.
std::vector<char> looked_at(const std::string &path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) refuse(std::strerror(errno));
    std::vector<char> bytes(static_cast<size_t>(file.tellg()));
    file.seekg(0).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    look_at(Image(bytes));
    return bytes;
}

void *open_library(const std::string &path) {
    void *handle = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle == nullptr) refuse(dlerror());
    return handle;
}

/// A file in memory, for as long as this lives.
class MemoryFile {
  public:
    explicit MemoryFile(const std::vector<char> &bytes)
        : file_(memfd_create("guest", MFD_CLOEXEC)) {
        if (file_ < 0) refuse(std::strerror(errno));
        for (size_t written = 0; written < bytes.size();) {
            const ssize_t more = write(file_, bytes.data() + written, bytes.size() - written);
            if (more <= 0) refuse(std::strerror(errno));
            written += static_cast<size_t>(more);
        }
    }
    ~MemoryFile() { close(file_); }
    MemoryFile(const MemoryFile &) = delete;
    MemoryFile &operator=(const MemoryFile &) = delete;

    /// The loader takes two files of one name for the same, and numbers of files come again: so
    /// each has a name of its own.
    std::string name() const {
        static size_t files = 0;
        return "/proc/self/fd" + std::string(++files, '/') + std::to_string(file_);
    }

  private:
    int file_;
};

/// Returns the result of `load`, whose errors begin with `failure`.
template <typename Load> void *load_or_tell(const std::string &failure, Load load) {
    try {
        return load();
    } catch (const EngineError &error) {
        throw EngineError(failure + ": " + error.what());
    }
}

}  // namespace

void *load_guest_file(const std::string &path, const std::string &failure) {
    return load_or_tell(failure, [&] {
        looked_at(path);
        return open_library(path);
    });
}

void *load_guest_copy(const std::string &path, const std::string &failure) {
    return load_or_tell(failure, [&] { return open_library(MemoryFile(looked_at(path)).name()); });
}

}  // namespace kilotwin
