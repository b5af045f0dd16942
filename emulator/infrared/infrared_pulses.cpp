#include "infrared/infrared_pulses.h"

#include <cstring>

namespace kilotwin {

namespace {

constexpr unsigned DATA_BITS = 8;

}  // namespace

std::vector<Cycles> pulses_of(const message_t &message) {
    uint8_t bytes[1 + sizeof message] = {};
    std::memcpy(bytes + 1, &message, sizeof message);
    std::vector<Cycles> pulses;
    unsigned slot = 0;
    for (uint8_t byte : bytes) {
        const unsigned bits = 1u | unsigned{byte} << 1 | 1u << STOP_SLOT;
        for (unsigned i = 0; i < BYTE_SLOTS; i++, slot++)
            if ((bits >> i & 1) != 0) pulses.push_back(slot * SLOT_CYCLES);
    }
    return pulses;
}

PulseReader::Found PulseReader::pulse(Cycles at) {
    if (torn_off(at)) reset();
    const bool begins = !reading_;
    last_ = at;
    if (begins) {
        reading_ = true;
        begun_at_ = at;
        bytes_ = 0;
        in_byte_ = false;
    }
    if (!in_byte_) {
        in_byte_ = true;
        byte_at_ = at;
        value_ = 0;
        return begins ? Found::BEGIN : Found::NOTHING;
    }
    // As a robot does: the slot whose middle is nearest.
    const Cycles slot = (at - byte_at_ + SLOT_CYCLES / 2) / SLOT_CYCLES;
    if (slot >= 1 && slot <= DATA_BITS) {
        value_ = static_cast<uint8_t>(value_ | 1u << (slot - 1));
        return Found::NOTHING;
    }
    in_byte_ = false;
    if (slot != STOP_SLOT || (bytes_ == 0 && value_ != 0)) {
        reset();
        return Found::NONSENSE;
    }
    if (bytes_ > 0) reinterpret_cast<uint8_t *>(&message_)[bytes_ - 1] = value_;
    if (++bytes_ <= sizeof message_) return Found::NOTHING;
    reset();
    return Found::MESSAGE;
}

}  // namespace kilotwin
