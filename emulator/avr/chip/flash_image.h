/// What is programmed into an ATmega328P, as read from a file that people flash.
#ifndef KILOTWIN_AVR_CHIP_FLASH_IMAGE_H
#define KILOTWIN_AVR_CHIP_FLASH_IMAGE_H

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace kilotwin {

class FlashImage {
  public:
    static constexpr size_t BYTES = 32 * 1024;

    /// Reads Intel HEX (records 00 to 05) or an ELF executable for AVR, by what the file begins with.
    /// Throws EngineError, with the file and the line, when it cannot be flashed: it is damaged, empty, for
    /// another processor, or does not fit.
    static std::shared_ptr<const FlashImage> load(const std::string &path);

    /// The whole flash; what the file does not say is erased, 0xFF.
    const std::array<uint8_t, BYTES> &bytes() const { return bytes_; }

    /// What the file says of the EEPROM, by address; often nothing.
    const std::map<uint16_t, uint8_t> &eeprom() const { return eeprom_; }

    /// Where the boot section begins, and so the vectors of a loader that moves them: the fuses BOOTSZ allow four
    /// places, and a loader lies at the beginning of its section. 0x7000, as the Kilobot has it, if the file holds
    /// none.
    uint32_t boot_section() const;

    /// One beyond the last byte of the flash that the file programs.
    size_t end() const { return end_; }

    /// The file's name without its folders.
    const std::string &name() const { return name_; }

    /// Address of a variable in SRAM, or of a function in bytes. Only ELF files know.
    std::optional<uint16_t> symbol(const std::string &name) const;

  private:
    FlashImage() { bytes_.fill(0xFF); }
    void read_hex(const std::string &path, const std::string &text);
    void read_elf(const std::string &path, const std::string &content);
    void take(uint32_t address, const uint8_t *data, size_t count, const std::string &where);
    void program(uint32_t address, const uint8_t *data, size_t count, const std::string &where);

    std::array<uint8_t, BYTES> bytes_;
    std::map<uint16_t, uint8_t> eeprom_;
    std::array<bool, BYTES> programmed_{};
    size_t end_ = 0;
    std::string name_;
    std::map<std::string, uint16_t> symbols_;
};

}  // namespace kilotwin

#endif
