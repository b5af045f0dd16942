#include "avr/chip/serial_programming.h"

namespace kilotwin {

namespace {

// First bytes of the instructions (data sheet, table 27-18).
enum Instruction : uint8_t {
    CONTROL = 0xAC,
    POLL_READY = 0xF0,
    LOAD_FLASH_LOW = 0x40,
    LOAD_FLASH_HIGH = 0x48,
    WRITE_FLASH_PAGE = 0x4C,
    READ_FLASH_LOW = 0x20,
    READ_FLASH_HIGH = 0x28,
    WRITE_EEPROM = 0xC0,
    LOAD_EEPROM = 0xC1,
    WRITE_EEPROM_PAGE = 0xC2,
    READ_EEPROM = 0xA0,
    READ_SIGNATURE = 0x30,
    READ_CALIBRATION = 0x38,
    READ_LOW_OR_EXTENDED = 0x50,
    READ_LOCK_OR_HIGH = 0x58
};
// Second bytes of CONTROL.
enum Control : uint8_t {
    ENABLE = 0x53,
    ERASE = 0x80,
    WRITE_LOW = 0xA0,
    WRITE_HIGH = 0xA8,
    WRITE_EXTENDED = 0xA4,
    WRITE_LOCK = 0xE0
};
// Bits of the high fuse, programmed when 0.
constexpr uint8_t RSTDISBL = 1 << 7, SPIEN = 1 << 5, EESAVE = 1 << 3;
// Bits that do not exist read as 1.
constexpr uint8_t NO_EXTENDED_FUSE = 0xF8, NO_LOCK_BIT = 0xC0;
// The lowest two lock bits are for programmers: 3 is open, 2 forbids writing, 0 reading too.
constexpr uint8_t LOCK_MODE = 3, OPEN = 3, NEITHER = 0;
constexpr uint8_t READY = 0;  // bit 0 would say busy

}  // namespace

void SerialProgramming::reset() {
    flash_page_.fill(0xFF);
    eeprom_page_.fill(0xFF);
    eeprom_loaded_ = 0;
    enabled_ = false;
}

bool SerialProgramming::may_write() const { return (memory_.lock_bits & LOCK_MODE) == OPEN; }
bool SerialProgramming::may_read() const { return (memory_.lock_bits & LOCK_MODE) != NEITHER; }

/// Lock bits are erased last, so that a locked chip shows nothing.
void SerialProgramming::erase() {
    memory_.flash.fill(0xFF);
    if ((memory_.high_fuse & EESAVE) != 0) memory_.eeprom.fill(0xFF);
    memory_.lock_bits = 0xFF;
}

/// Writes a fuse byte or the lock bits.
void SerialProgramming::configure(uint8_t which, uint8_t value) {
    if (which == WRITE_LOCK) {
        memory_.lock_bits &= value | NO_LOCK_BIT;
        return;
    }
    if (!may_write()) return;
    switch (which) {
    case WRITE_LOW: memory_.low_fuse = value; break;
    case WRITE_EXTENDED: memory_.extended_fuse = value | NO_EXTENDED_FUSE; break;
    case WRITE_HIGH:
        // SPIEN is out of reach this way: a programmer cannot lock itself out.
        memory_.high_fuse = (value & ~SPIEN) | (memory_.high_fuse & SPIEN);
        break;
    default: break;
    }
}

uint8_t SerialProgramming::configuration(uint8_t first, uint8_t second) const {
    constexpr uint8_t OTHER = 1 << 3;
    const bool other = (second & OTHER) != 0;
    if (first == READ_LOCK_OR_HIGH) return other ? memory_.high_fuse : memory_.lock_bits;
    return other ? memory_.extended_fuse : memory_.low_fuse;
}

/// The buffer is erased with the write, as on the chip.
void SerialProgramming::write_flash_page(uint16_t word) {
    const size_t page = size_t{word} * 2 % FlashImage::BYTES / FLASH_PAGE_BYTES * FLASH_PAGE_BYTES;
    for (size_t i = 0; i < FLASH_PAGE_BYTES; i++) memory_.flash[page + i] &= flash_page_[i];
    flash_page_.fill(0xFF);
}

/// Writes only bytes that have been loaded.
void SerialProgramming::write_eeprom_page(uint16_t address) {
    const size_t page = address % EEPROM_BYTES / EEPROM_PAGE_BYTES * EEPROM_PAGE_BYTES;
    for (size_t i = 0; i < EEPROM_PAGE_BYTES; i++)
        if ((eeprom_loaded_ >> i & 1) != 0) memory_.eeprom[page + i] = eeprom_page_[i];
    eeprom_loaded_ = 0;
}

/// Whether it was an instruction that loads or writes; it is carried out if lock bits let it.
bool SerialProgramming::write(const Bytes &instruction) {
    const auto [first, second, third, value] = instruction;
    const auto address = static_cast<uint16_t>(second << 8 | third);
    const size_t word = third * size_t{2} % FLASH_PAGE_BYTES;
    switch (first) {
    case LOAD_FLASH_LOW: flash_page_[word] = value; return true;
    case LOAD_FLASH_HIGH: flash_page_[word + 1] = value; return true;
    case LOAD_EEPROM:
        eeprom_page_[third % EEPROM_PAGE_BYTES] = value;
        eeprom_loaded_ |= static_cast<uint8_t>(1 << third % EEPROM_PAGE_BYTES);
        return true;
    case WRITE_FLASH_PAGE:
        if (may_write()) write_flash_page(address);
        return true;
    case WRITE_EEPROM_PAGE:
        if (may_write()) write_eeprom_page(address);
        return true;
    case WRITE_EEPROM:
        if (may_write()) memory_.eeprom[address % EEPROM_BYTES] = value;
        return true;
    default: return false;
    }
}

uint8_t SerialProgramming::read(const Bytes &instruction) const {
    const auto [first, second, third, value] = instruction;
    const auto address = static_cast<uint16_t>(second << 8 | third);
    const size_t byte = size_t{address} * 2 % FlashImage::BYTES;
    switch (first) {
    case READ_FLASH_LOW: return may_read() ? memory_.flash[byte] : 0xFF;
    case READ_FLASH_HIGH: return may_read() ? memory_.flash[byte + 1] : 0xFF;
    case READ_EEPROM: return may_read() ? memory_.eeprom[address % EEPROM_BYTES] : 0xFF;
    case READ_SIGNATURE: return third < memory_.signature.size() ? memory_.signature[third] : 0xFF;
    case READ_CALIBRATION: return memory_.calibration;
    case READ_LOW_OR_EXTENDED:
    case READ_LOCK_OR_HIGH: return configuration(first, second);
    case POLL_READY: return READY;
    default: return third;  // the echo
    }
}

SerialProgramming::Bytes SerialProgramming::shift(const Bytes &instruction) {
    const auto [first, second, third, value] = instruction;
    const bool open = (memory_.high_fuse & SPIEN) == 0 && (memory_.high_fuse & RSTDISBL) != 0;
    if (first == CONTROL && second == ENABLE && open) enabled_ = true;
    if (!enabled_) return {};
    Bytes out = {0, first, second, third};
    if (first == CONTROL && second == ERASE)
        erase();
    else if (first == CONTROL)
        configure(second, value);
    else if (!write(instruction))
        out[3] = read(instruction);
    return out;
}

}  // namespace kilotwin
