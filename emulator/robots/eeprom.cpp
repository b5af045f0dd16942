#include "robots/eeprom.h"

namespace kilotwin {

std::optional<uint8_t> gain_byte(const InfraredGains &gains, uint16_t address) {
    auto half = [](uint16_t gain, int byte) {
        return static_cast<uint8_t>(byte % 2 == 0 ? gain >> 8 : gain);
    };
    constexpr uint16_t TABLE_BYTES = 2 * GAIN_ENTRIES;
    if (const int byte = address - EEPROM_LOW_GAIN; byte >= 0 && byte < TABLE_BYTES)
        return half(gains.low(byte / 2), byte);
    if (const int byte = address - EEPROM_HIGH_GAIN; byte >= 0 && byte < TABLE_BYTES)
        return half(gains.high(byte / 2), byte);
    return std::nullopt;
}

uint8_t calibrated_byte(const Calibration &calibration, uint16_t address) {
    constexpr uint8_t ERASED = 0xFF, IR_LED = 1 << 0;
    if (const auto gain = gain_byte(calibration.gains, address)) return *gain;
    switch (address) {
    case EEPROM_TURN_LEFT: return calibration.turn_left;
    case EEPROM_TURN_RIGHT: return calibration.turn_right;
    case EEPROM_STRAIGHT_LEFT: return calibration.straight_left;
    case EEPROM_STRAIGHT_RIGHT: return calibration.straight_right;
    case EEPROM_INFRARED_PINS: return IR_LED;
    case EEPROM_UID: return static_cast<uint8_t>(calibration.uid);
    case EEPROM_UID + 1: return static_cast<uint8_t>(calibration.uid >> 8);
    default: return ERASED;
    }
}

EepromImage eeprom_of(const Calibration &calibration) {
    EepromImage image;
    for (uint16_t address = 0; address < EEPROM_BYTES; address++)
        image[address] = calibrated_byte(calibration, address);
    return image;
}

}  // namespace kilotwin
