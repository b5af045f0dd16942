#include "avr/boards/pca9635.h"

namespace kilotwin {

namespace {

// Registers, by the data sheet's names.
enum : uint8_t {
    MODE1 = 0x00,
    MODE2 = 0x01,
    PWM0 = 0x02,
    PWM15 = 0x11,
    GRPPWM = 0x12,
    GRPFREQ = 0x13,
    LEDOUT0 = 0x14,
    SUBADR1 = 0x18,
    ALLCALLADR = 0x1B,
};
constexpr uint8_t SLEEP = 1 << 4, ALLCALL = 1 << 0, MODE1_READ_ONLY = 7 << 5;
constexpr uint8_t REGISTER = 31, INCREMENT_SHIFT = 5;
// Ranges of the automatic increment: the upper three bits of the control register.
enum Increment : uint8_t { NONE, ALL = 4, INDIVIDUAL = 5, GLOBAL = 6, INDIVIDUAL_AND_GLOBAL = 7 };
enum LedOut : uint8_t { OFF, FULL, PWM, GROUP };
// The software reset call, an address and two bytes.
constexpr uint8_t RESET_CALL = 0x06, RESET_BYTES[] = {0xA5, 0x5A};
constexpr uint8_t NO_RESET_CALL = 0xFF;

}  // namespace

void Pca9635::reset() {
    registers_.fill(0);
    registers_[MODE1] = SLEEP | ALLCALL;
    registers_[MODE2] = 0x05;
    registers_[GRPPWM] = 0xFF;
    const uint8_t calls[] = {0xE2, 0xE4, 0xE8, 0xE0};
    for (unsigned i = 0; i < sizeof calls; i++) registers_[SUBADR1 + i] = calls[i];
    control_ = 0;
    control_due_ = false;
    reset_bytes_ = NO_RESET_CALL;
}

bool Pca9635::address(uint8_t byte) {
    control_due_ = (byte & 1) == 0;
    reset_bytes_ = byte == RESET_CALL ? 0 : NO_RESET_CALL;
    if (byte == RESET_CALL || byte >> 1 == address_) return true;
    if ((byte & 1) != 0) return false;
    // SUB1 to SUB3 are bits 3 to 1 of MODE1, ALLCALL is bit 0.
    for (unsigned i = 0; i < 4; i++)
        if ((registers_[MODE1] >> (3 - i) & 1) != 0 && registers_[SUBADR1 + i] == byte) return true;
    return false;
}

/// The first byte after the address is the control register, the others go to where it points.
bool Pca9635::write(uint8_t byte) {
    if (reset_bytes_ != NO_RESET_CALL) {
        if (reset_bytes_ >= sizeof RESET_BYTES || byte != RESET_BYTES[reset_bytes_]) return false;
        reset_bytes_++;
        return true;
    }
    if (control_due_) {
        control_ = byte;
        control_due_ = false;
        return true;
    }
    const unsigned place = control_ & REGISTER;
    if (place >= registers_.size()) return false;
    registers_[place] =
        place == MODE1 ? static_cast<uint8_t>((control_ & MODE1_READ_ONLY) | (byte & 0x1F)) : byte;
    advance();
    return true;
}

uint8_t Pca9635::read() {
    const unsigned place = control_ & REGISTER;
    const uint8_t value = place < registers_.size() ? registers_[place] : 0;
    advance();
    return value;
}

void Pca9635::stop() {
    if (reset_bytes_ == sizeof RESET_BYTES) reset();
    reset_bytes_ = NO_RESET_CALL;
}

/// Increments the register as the control register says, within its range of registers.
void Pca9635::advance() {
    unsigned first = MODE1, last = ALLCALLADR;
    switch (control_ >> INCREMENT_SHIFT) {
    case ALL: break;
    case INDIVIDUAL: first = PWM0, last = PWM15; break;
    case GLOBAL: first = GRPPWM, last = GRPFREQ; break;
    case INDIVIDUAL_AND_GLOBAL: first = PWM0, last = GRPFREQ; break;
    default: return;
    }
    const unsigned place = control_ & REGISTER;
    const unsigned next = place == last ? first : place + 1;
    control_ = static_cast<uint8_t>((control_ & ~REGISTER) | (next & REGISTER));
}

uint8_t Pca9635::light(unsigned output) const {
    const unsigned mode = registers_[LEDOUT0 + output / 4] >> 2 * (output % 4) & 3u;
    const uint8_t own = registers_[PWM0 + output];
    // Asleep, its oscillator is off: outputs can only be fully on or off.
    const bool asleep = (registers_[MODE1] & SLEEP) != 0;
    switch (mode) {
    case FULL: return 0xFF;
    case PWM: return asleep ? 0 : own;
    case GROUP: return asleep ? 0 : static_cast<uint8_t>(own * registers_[GRPPWM] / 255);
    default: return 0;
    }
}

}  // namespace kilotwin
