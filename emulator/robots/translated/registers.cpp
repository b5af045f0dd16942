// Registers of a translated robot that do more than a byte of memory (translated/robot.h).
#include <algorithm>
#include <cstring>
#include <utility>

#include "base/serial_line.h"
#include "robots/native/outputs.h"
#include "robots/translated/robot.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr uint64_t EEPROM_WRITE_CYCLES = CYCLES_PER_SECOND * 34 / 10'000;  // 3.4 ms
constexpr unsigned SERIAL_BITS = 10;  // of a byte, with start and stop

/// A register, and which accesses to it are more than memory.
struct Effect {
    uint16_t address;
    uint8_t effects;
};

constexpr Effect EFFECTS[] = {
    {DDRB, PIN_EFFECT},
    {PORTB, PIN_EFFECT},
    {DDRC, PIN_EFFECT},
    {PORTC, PIN_EFFECT},
    {DDRD, PIN_EFFECT},
    {PORTD, PIN_EFFECT},
    {OCR2A, PIN_EFFECT},
    {OCR2B, PIN_EFFECT},
    {TIFR0, WRITE_EFFECT},
    {TCCR0B, WRITE_EFFECT},
    {TCNT0, READ_EFFECT | WRITE_EFFECT},
    {OCR0A, CHANGE_EFFECT},
    {TIMSK0, WRITE_EFFECT},
    {TCNT1L, READ_EFFECT},
    {TCNT1H, READ_EFFECT},
    {EECR, READ_EFFECT | WRITE_EFFECT},
    {ADCSRA, WRITE_EFFECT},
    {UCSR0A, READ_EFFECT},
    {UCSR0B, CHANGE_EFFECT},
    {UDR0, WRITE_EFFECT},
};

/// The same by address.
struct Effects {
    uint8_t of[0x100] = {};
    constexpr Effects() {
        for (const auto &effect : EFFECTS) of[effect.address] = effect.effects;
    }
};

}  // namespace

const uint8_t *TranslatedProgram::effects() {
    static constexpr Effects EFFECTS_OF;
    return EFFECTS_OF.of;
}

/// Counts, and flags of what takes its time.
uint8_t TranslatedRobot::read_register(translated_chip_t *chip, uint16_t address) {
    auto &robot = *static_cast<TranslatedRobot *>(chip);
    auto &image = robot.image_;
    const uint64_t now = robot.cycle();
    // It depends on the time, but for an EEPROM that is not busy.
    if (address != EECR || now < robot.eeprom_free()) robot.changed = CHANGED;
    switch (address) {
    case UCSR0A:
        robot.leave_out_polls();
        return robot.cycle() < image.serial_free ? 0 : UCSR0A_UDRE;
    case EECR: return now < robot.eeprom_free() ? robot.at(EECR) | EECR_EEPE : robot.at(EECR);
    case TCNT0: return static_cast<uint8_t>((now - image.timer_zero) / COUNT_CYCLES);
    case TCNT1L: image.latch = static_cast<uint8_t>(now >> 8); return static_cast<uint8_t>(now);
    case TCNT1H: return image.latch;
    default: return robot.at(address);
    }
}

void TranslatedRobot::register_written(translated_chip_t *chip, uint16_t address) {
    static_cast<TranslatedRobot *>(chip)->register_written(address);
}

void TranslatedRobot::register_written(uint16_t address) {
    constexpr uint8_t BEGINS_WRITE = EECR_EEPE | EECR_EEMPE;
    if (address != EECR || (at(EECR) & BEGINS_WRITE) != 0) changed = CHANGED;
    switch (address) {
    case TIFR0:
    case TCCR0B:
    case TCNT0:
    case OCR0A:
    case TIMSK0: timer_written(address); break;
    case EECR: eeprom_written(); break;
    case ADCSRA: at(ADCSRA) &= static_cast<uint8_t>(~ADCSRA_ADSC); break;  // at once
    case UDR0: print(at(UDR0)); break;
    case UCSR0B: limit_changed_ = true; break;
    default: look_at_pins();
    }
}

/// Whether timer 0 counts and its match is an interrupt.
bool TranslatedRobot::timer_ticks() const {
    return (data[TCCR0B] & TCCR0B_CS) != 0 && (data[TIMSK0] & TIMER0_MATCH_A) != 0;
}

/// A flag is cleared by writing a one; any other register may move the next match.
void TranslatedRobot::timer_written(uint16_t address) {
    if (address == TIFR0 && (at(TIFR0) & TIMER0_MATCH_A) != 0)
        image_.flagged = TranslatedImage::NO_TIME;
    if (address == TCNT0) image_.timer_zero = cycle() - Cycles{at(TCNT0)} * COUNT_CYCLES;
    if (address == TIFR0) return;
    if (!timer_ticks()) image_.flagged = TranslatedImage::NO_TIME;
    find_match();
    limit_changed_ = true;
}

/// The next time that timer 0 has counted the compare value to its end.
void TranslatedRobot::find_match() {
    image_.match = TranslatedImage::NO_TIME;
    if (!timer_ticks()) return;
    const uint64_t now = cycle();
    const uint64_t offset = (Cycles{at(OCR0A)} + 1) * COUNT_CYCLES;
    const uint64_t since = now - image_.timer_zero;
    image_.match = image_.timer_zero + since / TICK_CYCLES * TICK_CYCLES + offset;
    if (image_.match <= now) image_.match += TICK_CYCLES;
}

/// A read is there at once; a write takes its time, and the byte is read as written meanwhile.
void TranslatedRobot::eeprom_written() {
    const uint8_t control = at(EECR);
    const auto address = static_cast<uint16_t>(word(EEARL) % EEPROM_BYTES);
    if ((control & EECR_EERE) != 0) set_register(EEDR, robot_.eeprom(address));
    const bool is_free = cycle() >= eeprom_free();
    if (is_free && (control & EECR_EEPE) != 0 && (control & EECR_EEMPE) != 0) {
        robot_.set_eeprom(address, at(EEDR));
        state_.written().eeprom_free = cycle() + EEPROM_WRITE_CYCLES;
    }
    set_register(EECR, control & (EECR_EEPE | EECR_EERE) ? 0 : control & EECR_EEMPE);
}

/// A byte that the engine changes, and that is summed up as one that the code does.
void TranslatedRobot::set_register(uint16_t address, uint8_t value) {
    net += translated_weight(address) * (uint64_t{value} - at(address));
    at(address) = value;
}

/// A program that prints mostly waits for the line, and each look is the interpreter's. Of the loop
/// that avr-gcc makes of such a wait only the last turn is executed: it finds the line free, or an
/// interrupt comes in it.
void TranslatedRobot::leave_out_polls() {
    // lds r, UCSR0A; sbrs r, UDRE0; rjmp to the lds: the three take `TURN` cycles.
    constexpr uint16_t LDS = 0x9000, LDS_MASK = 0xFE0F, REGISTER = 0x01F0, SBRS_UDRE0 = 0xFE05,
                       RJMP_BACK = 0xCFFC;
    constexpr int64_t TURN = 5;
    const uint16_t load = flash_word(flash, pc);
    const bool waits = (load & LDS_MASK) == LDS &&
                       flash_word(flash, pc + 4) == (SBRS_UDRE0 | (load & REGISTER)) &&
                       flash_word(flash, pc + 6) == RJMP_BACK;
    const auto busy = static_cast<int64_t>(image_.serial_free - cycle());
    if (executes != 0 || !waits || busy <= 0 || left <= 0) return;
    left -= std::min((busy + TURN - 1) / TURN, (left - 1) / TURN) * TURN;
}

/// The line is busy for the time of a byte.
void TranslatedRobot::print(uint8_t byte) {
    const unsigned scale = (at(UCSR0A) & UCSR0A_U2X) != 0 ? 8 : 16;
    const unsigned rate = word(UBRR0L) & 0xFFF;
    image_.serial_free = cycle() + uint64_t{SERIAL_BITS} * scale * (rate + 1);
    limit_changed_ = true;
    auto &line = state_.written().line;
    if (line == nullptr) line = Own<std::string>::make();
    if (!ends_line(*line, byte)) return;
    robot_.last_tick = ticks_now();
    robot_.now = world_time();
    robot_.report(EventKind::PRINT, std::exchange(*line, {}));
}

/// In the midst of code, or, with 0, where passes have been left out that show other colours: as
/// if they had, the next one is no decision that comes after a tick without any. What motors do
/// matters at its time, so that a pass that changes them is executed.
uint8_t TranslatedRobot::pin_written(uint16_t address) {
    if (address == 0) {
        robot_.last_decision = std::max(robot_.last_decision, world_time());
        return 0;
    }
    const auto left_motor = robot_.left, right_motor = robot_.right;
    const auto color = robot_.color;
    look_at_pins();
    if (robot_.left != left_motor || robot_.right != right_motor) return CHANGED;
    return robot_.color != color ? SHOWN : 0;
}

/// Motors and LED are what the ports and timer 2 make of them.
void TranslatedRobot::look_at_pins() {
    const kt_outputs_t outputs = {at(OCR2A), at(OCR2B), at(DDRB),  at(DDRC),
                                  at(DDRD),  at(PORTB), at(PORTC), at(PORTD)};
    uint64_t seen;
    std::memcpy(&seen, &outputs, sizeof seen);
    robot_.now = world_time();
    if (seen == robot_.outputs_seen) return;
    robot_.outputs_seen = seen;
    const uint8_t color = robot_.color;
    const uint16_t duties = this->duties();
    take_outputs(robot_, outputs);
    if (robot_.context->trail != nullptr) [[unlikely]]
        note_outputs(color, duties);
}

}  // namespace kilotwin
