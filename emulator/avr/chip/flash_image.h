/// The content of an ATmega328P's flash and EEPROM, as read from a file that is made for flashing.
///
/// Immutable once loaded, so any number of chips may share one. 32 KB and the symbols; loading
/// costs milliseconds.
#ifndef KILOTWIN_AVR_CHIP_FLASH_IMAGE_H
#define KILOTWIN_AVR_CHIP_FLASH_IMAGE_H

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "robots/translated/code.h"

namespace kilotwin {

class FlashImage {
  public:
    static constexpr size_t BYTES = 32 * 1024;

    /// Reads Intel HEX (records 00 to 05), an ELF executable for AVR, or what the host has made of
    /// one for this computer (avr/chip/translated_core.h): NAME.so, where the image was NAME. Of
    /// the others the first bytes decide. Throws EngineError, with the file and the line, if it
    /// cannot be flashed: damaged, empty, for another processor, too large, or without a piece in
    /// its middle.
    static std::shared_ptr<const FlashImage> load(const std::string &path);

    /// The same with several files in one flash, such as an application and a boot loader. A byte
    /// that two of them give differently is an error, too.
    static std::shared_ptr<const FlashImage> load_together(const std::vector<std::string> &paths);

    /// The content of a chip: bytes of 0xFF count as not programmed.
    static std::shared_ptr<const FlashImage> of(const std::array<uint8_t, BYTES> &content,
                                                const std::string &name);

    /// Code of this computer, if the file was that; null: the chip interprets. It lives as long as
    /// the process.
    const translation_t *translation() const { return translation_; }

    /// The whole flash; bytes that the file does not give are erased, 0xFF.
    const std::array<uint8_t, BYTES> &bytes() const { return bytes_; }

    /// Bytes that the file gives for the EEPROM, by address (0..1023); often none.
    const std::map<uint16_t, uint8_t> &eeprom() const { return eeprom_; }

    /// Begin of the boot section, a byte address, and so of the vectors of a boot loader that moves
    /// them. The fuses BOOTSZ allow four places, and a boot loader lies at the begin of its
    /// section: the lowest of these places that the file programs; 0x7000, the Kilobot's, if it
    /// programs none.
    uint32_t boot_section() const;

    /// Whether interrupts lead where an overhead controller's program has them: it receives by the
    /// serial line and not by the comparator, which hears robots' infrared.
    bool is_overhead_controllers() const;

    /// One beyond the last byte of the flash that the file programs; at least 1.
    size_t end() const { return end_; }

    /// The first file's name without its folders.
    const std::string &name() const { return name_; }

    /// Address of a variable in SRAM, or byte address of a function. Only ELF files have symbols.
    std::optional<uint16_t> symbol(const std::string &name) const;

  private:
    FlashImage() { bytes_.fill(0xFF); }
    void add(const std::string &path);
    void read_hex(const std::string &path, const std::string &text);
    void check_middle(const std::string &path) const;
    void read_translation(const std::string &path);
    void read_elf(const std::string &path, const std::string &content);
    void load_bytes(uint32_t address, const uint8_t *data, size_t count, const std::string &where);
    void program(uint32_t address, const uint8_t *data, size_t count, const std::string &where);

    std::array<uint8_t, BYTES> bytes_;
    std::map<uint16_t, uint8_t> eeprom_;
    std::array<bool, BYTES> programmed_{};  ///< bytes that the file gives
    size_t end_ = 0;                        ///< 0: nothing is programmed
    std::string name_;
    std::map<std::string, uint16_t> symbols_;
    const translation_t *translation_ = nullptr;
};

}  // namespace kilotwin

#endif
