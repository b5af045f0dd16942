#include "avr/chip/translated_core.h"

#include <dlfcn.h>
#include <simavr/sim_avr.h>

#include <algorithm>
#include <cstring>

#include "base/errors.h"
#include "base/registers.h"
#include "robots/native/guest_file.h"

namespace kilotwin {

namespace {

constexpr uint16_t FIRST_IO = 0x20;
// A skip at a region's end depends on the word behind it.
constexpr uint32_t LOOK_AHEAD = 2;

translated_end_t interpret_one(translated_chip_t *) { return INTERPRET_ONE; }

}  // namespace

const translation_t &load_translation(const std::string &path) {
    void *library = load_guest_file(path, "cannot load " + path);
    const auto *translation = static_cast<const translation_t *>(dlsym(library, "translation"));
    if (translation == nullptr || translation->version != TRANSLATION_VERSION)
        throw EngineError(path + ": made for another version of the engine; remove the file");
    return *translation;
}

TranslatedCore::TranslatedCore(avr_t *avr, const translation_t &translation)
    : avr_(avr),
      translation_(translation),
      code_(translation.code) {
    find_effects();
}

uint64_t TranslatedCore::run(uint64_t until) {
    translated_chip_t chip = {};
    chip.data = avr_->data;
    chip.flags = avr_->sreg;
    chip.flash = avr_->flash;
    chip.effects = effects_.data();
    chip.left = static_cast<int64_t>(until - avr_->cycle);
    chip.pc = avr_->pc;
    translated_end_t end = GO_ON;
    while (chip.left > 0 && end == GO_ON) {
        const uint32_t word = chip.pc / 2;
        const unsigned region =
            word < atmega328p::FLASH_BYTES / 2 ? translation_.region_of[word] : 0;
        end = region != 0 ? code_[region - 1](&chip) : INTERPRET_ONE;
    }
    avr_->cycle = until - static_cast<uint64_t>(chip.left);
    avr_->pc = chip.pc;
    if (chip.left <= 0) return 0;
    return end == INTERPRET_REST ? static_cast<uint64_t>(chip.left) : 1;
}

void TranslatedCore::find_effects() {
    for (size_t address = FIRST_IO; address < effects_.size(); address++) {
        const auto &io = avr_->io[AVR_DATA_TO_IO(address)];
        const bool reads = io.r.c != nullptr || io.irq != nullptr;
        const bool writes = io.w.c != nullptr || io.irq != nullptr;
        effects_[address] =
            static_cast<uint8_t>((reads ? READ_EFFECT : 0) | (writes ? WRITE_EFFECT : 0));
    }
}

void TranslatedCore::compare_flash() {
    own_.assign(translation_.code, translation_.code + translation_.regions);
    for (uint32_t region = 0; region < translation_.regions; region++) {
        const uint32_t begin = translation_.extent[region][0];
        const uint32_t end = std::min<uint32_t>(translation_.extent[region][1] + LOOK_AHEAD,
                                                atmega328p::FLASH_BYTES);
        if (std::memcmp(avr_->flash + begin, translation_.flash + begin, end - begin) != 0)
            own_[region] = interpret_one;
    }
    code_ = own_.data();
}

}  // namespace kilotwin
