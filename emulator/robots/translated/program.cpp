#include "robots/translated/program.h"

#include <dlfcn.h>

#include <cstddef>
#include <cstring>
#include <map>
#include <memory>
#include <utility>

#include "base/errors.h"
#include "base/registers.h"
#include "robots/native/guest_file.h"

namespace kilotwin {

namespace {

/// By path.
std::map<std::string, std::unique_ptr<TranslatedProgram>> &loaded() {
    static std::map<std::string, std::unique_ptr<TranslatedProgram>> all;
    return all;
}

/// Whether both are translations of the same image, which may be entered at the same places.
bool are_alike(const translation_t &one, const translation_t &other) {
    const auto same = [](const auto *a, const auto *b, size_t count) {
        return std::memcmp(a, b, count * sizeof *a) == 0;
    };
    const translated_seam_t &a = *one.seam, &b = *other.seam;
    return one.version == other.version && one.regions == other.regions &&
           one.eeprom_bytes == other.eeprom_bytes && same(one.extent, other.extent, one.regions) &&
           same(one.region_of, other.region_of, atmega328p::FLASH_BYTES / 2) &&
           same(one.flash, other.flash, atmega328p::FLASH_BYTES) &&
           same(one.eeprom, other.eeprom, one.eeprom_bytes) && std::memcmp(&a, &b, sizeof a) == 0;
}

}  // namespace

TranslatedProgram &TranslatedProgram::load(const std::string &path, const std::string &name) {
    auto &program = loaded()[path];
    if (!program) program.reset(new TranslatedProgram(path, name));
    return *program;
}

void TranslatedProgram::take_over(const std::string &path, const std::string &faster) {
    const auto [program, code] = another(path, faster);
    program->code_ = code;
}

void TranslatedProgram::hold_by(const std::string &path, const std::string &name,
                                const std::string &debugged, const std::string &watched) {
    TranslatedProgram &program = load(path, name);
    program.debugged_ = another(path, debugged).second;
    program.watched_ = another(path, watched).second;
}

std::pair<TranslatedProgram *, const translation_t *>
TranslatedProgram::another(const std::string &path, const std::string &other) {
    const auto found = loaded().find(path);
    if (found == loaded().end()) throw EngineError(path + " is no translation that is loaded");
    TranslatedProgram &program = *found->second;
    void *handle = load_guest_file(other, "code of " + program.name_ + " cannot be loaded");
    const auto *code = static_cast<const translation_t *>(dlsym(handle, "translation"));
    if (code == nullptr || code->version != TRANSLATION_VERSION || code->seam == nullptr ||
        !are_alike(program.code(), *code))
        throw EngineError(other + " is no translation of " + program.name_);
    return {&program, code};
}

TranslatedProgram::TranslatedProgram(const std::string &path, std::string name)
    : name_(std::move(name)),
      path_(path) {
    void *handle = load_guest_file(path, "program " + name_ + " cannot be loaded");
    code_ = static_cast<const translation_t *>(dlsym(handle, "translation"));
    coverage_ = static_cast<uint8_t *>(dlsym(handle, "translation_coverage"));
    if (code_ == nullptr)
        throw EngineError(path + " is no translated program: it has no translation");
    if (code_->version != TRANSLATION_VERSION || code_->seam == nullptr)
        throw EngineError(path + ": made for another version of the engine; remove the file");
}

}  // namespace kilotwin
