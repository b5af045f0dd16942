/// Fuzz target: a file to be flashed, Intel HEX or ELF, with any bytes in it.
#include <sys/mman.h>
#include <unistd.h>

#include <cassert>
#include <cstdint>
#include <string>

#include "avr/chip/flash_image.h"
#include "avr/chip/translated_core.h"
#include "base/errors.h"

using namespace kilotwin;

// Only names that end in .so are loaded as code.
const translation_t &kilotwin::load_translation(const std::string &path) {
    throw EngineError(path);
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size) {
    static const int file = memfd_create("image", 0);
    static const std::string path = "/proc/self/fd/" + std::to_string(file);
    if (ftruncate(file, 0) != 0 || pwrite(file, input, size, 0) != static_cast<ssize_t>(size))
        return 0;
    try {
        const auto image = FlashImage::load(path);
        assert(image->end() >= 1 && image->end() <= FlashImage::BYTES);
        assert(image->boot_section() >= 0x7000);
        for (const auto &[address, value] : image->eeprom()) assert(address < 1024);
        image->is_overhead_controllers();
        image->symbol("main");
    } catch (const EngineError &) {
    }
    return 0;
}
