/// The memories that an ATmega328P keeps without power, and how a programmer reads and writes them
/// through the chip's SPI while reset is held low ("serial programming" in its data sheet,
/// DS40002061, 27.8).
#ifndef KILOTWIN_AVR_CHIP_SERIAL_PROGRAMMING_H
#define KILOTWIN_AVR_CHIP_SERIAL_PROGRAMMING_H

#include <array>
#include <cstdint>

#include "avr/chip/flash_image.h"
#include "robots/eeprom.h"

namespace kilotwin {

/// Contents of a chip without power. As it comes to life here: erased, with the fuses that a
/// Kilobot needs (8 MHz of its own oscillator, 4 KB of boot section, start at address 0, EEPROM
/// kept when the chip is erased; hardware.md 1.11) and open lock bits.
struct ChipMemory {
    std::array<uint8_t, FlashImage::BYTES> flash;
    EepromImage eeprom;
    uint8_t low_fuse = 0xE2, high_fuse = 0xD1, extended_fuse = 0xFF;
    uint8_t lock_bits = 0xFF;
    /// Factory's value for OSCCAL; differs from chip to chip.
    uint8_t calibration = 0x80;
    /// 1E 95 0F: ATmega328P. Another chip can be played by another one.
    std::array<uint8_t, 3> signature{0x1E, 0x95, 0x0F};

    ChipMemory() {
        flash.fill(0xFF);
        eeprom.fill(0xFF);
    }
};

/// The chip's side of the SPI. Erasing and writing take no time: it is never busy.
///
/// Flash is written by pages of 128 bytes, whose bits only go from 1 to 0; EEPROM by bytes or by
/// pages of four. Lock bits go from 1 to 0 until the chip is erased.
class SerialProgramming {
  public:
    static constexpr size_t FLASH_PAGE_BYTES = 128, EEPROM_PAGE_BYTES = 4;
    using Bytes = std::array<uint8_t, 4>;

    /// `memory` must live on.
    explicit SerialProgramming(ChipMemory &memory) : memory_(memory) { reset(); }

    /// A pulse of the reset line: page buffers are empty, and programming is to be enabled anew.
    void reset();

    /// Whether "programming enable" has been accepted since the last reset(). With the fuse SPIEN
    /// off, or reset made a pin by RSTDISBL, a chip cannot be programmed by its SPI.
    bool enabled() const { return enabled_; }

    /// Shifts an instruction in and returns what comes out meanwhile: each byte is that sent
    /// before it, the last one what the instruction reads, if it reads. Before programming is
    /// enabled, instructions do nothing and 0 comes out; unknown ones only echo.
    ///
    /// Lock bits forbid as they say: writing of flash, EEPROM and fuses in modes 2 and 3, reading
    /// in mode 3, where 0xFF comes out. Erasing the chip is always possible.
    Bytes shift(const Bytes &instruction);

  private:
    bool may_write() const;
    bool may_read() const;
    void erase();
    void configure(uint8_t which, uint8_t value);
    uint8_t configuration(uint8_t first, uint8_t second) const;
    void write_flash_page(uint16_t word);
    void write_eeprom_page(uint16_t address);
    bool write(const Bytes &instruction);
    uint8_t read(const Bytes &instruction) const;

    ChipMemory &memory_;
    std::array<uint8_t, FLASH_PAGE_BYTES> flash_page_;
    std::array<uint8_t, EEPROM_PAGE_BYTES> eeprom_page_;
    uint8_t eeprom_loaded_ = 0;  ///< bytes of the page that are in the buffer, bit by bit
    bool enabled_ = false;
};

}  // namespace kilotwin

#endif
