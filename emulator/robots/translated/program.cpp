#include "robots/translated/program.h"

#include <dlfcn.h>

#include <map>
#include <memory>
#include <utility>

#include "base/errors.h"
#include "robots/native/guest_file.h"

namespace kilotwin {

TranslatedProgram &TranslatedProgram::load(const std::string &path, const std::string &name) {
    static std::map<std::string, std::unique_ptr<TranslatedProgram>> loaded;
    auto &program = loaded[path];
    if (!program) program.reset(new TranslatedProgram(path, name));
    return *program;
}

TranslatedProgram::TranslatedProgram(const std::string &path, std::string name)
    : name_(std::move(name)),
      path_(path) {
    void *handle = load_guest_file(path, "program " + name_ + " cannot be loaded");
    code_ = static_cast<const translation_t *>(dlsym(handle, "translation"));
    if (code_ == nullptr)
        throw EngineError(path + " is no translated program: it has no translation");
    if (code_->version != TRANSLATION_VERSION || code_->seam == nullptr)
        throw EngineError(path + ": made for another version of the engine; remove the file");
}

}  // namespace kilotwin
