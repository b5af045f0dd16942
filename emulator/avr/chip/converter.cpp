#include "avr/chip/converter.h"

#include <algorithm>
#include <utility>

#include "base/registers.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// Durations in half cycles of the converter's clock (datasheet, ADC conversion time).
constexpr uint64_t FIRST_HALVES = 50, SINGLE_HALVES = 26, TRIGGERED_HALVES = 27;
constexpr int16_t MOST = 1023;

}  // namespace

Converter::Converter(Microcontroller &chip, Sample sample)
    : chip_(chip),
      sample_(std::move(sample)) {
    for (uint16_t address : {ADCL, ADCH, ADCSRA, ADCSRB}) chip_.take_over(address);
    chip_.watch_register(ADCSRA, Microcontroller::Watch::WRITES);
    for (uint8_t vector : ADC_TRIGGERS)
        if (vector != 0) chip_.watch_interrupt(vector);
}

uint8_t Converter::control() const { return chip_.read(ADCSRA); }

void Converter::control_written() {
    const uint8_t written = control();
    uint8_t now = written;
    // Writing a one clears the flag, as does entering its interrupt.
    if ((written & ADCSRA_ADIF) != 0) {
        chip_.clear_interrupt(VECTOR_ADC);
        now &= static_cast<uint8_t>(~ADCSRA_ADIF);
    }
    if ((written & ADCSRA_ADEN) == 0) {
        converting_ = false;
        first_ = true;
        chip_.set_alarm(Microcontroller::CONVERSION, Microcontroller::NO_ALARM);
        now &= static_cast<uint8_t>(~ADCSRA_ADSC);
    } else if (converting_) {
        now |= ADCSRA_ADSC;
    }
    chip_.write(ADCSRA, now);
    if ((now & ADCSRA_ADSC) != 0 && !converting_) start();
}

void Converter::flag_set(uint8_t vector) {
    const uint8_t wanted = ADCSRA_ADEN | ADCSRA_ADATE;
    if ((control() & wanted) == wanted && !converting_ &&
        ADC_TRIGGERS[chip_.read(ADCSRB) & ADCSRB_ADTS] == vector)
        start();
}

/// Samples now and sets the alarm for the end; a result read before is the last one's.
void Converter::start() {
    const bool triggered = (control() & ADCSRA_ADATE) != 0;
    // A prescaler of 0 divides by 2, as 1 does.
    const uint8_t scale = std::max<uint8_t>(control() & ADCSRA_ADPS, 1);
    const uint64_t halves = first_ ? FIRST_HALVES : triggered ? TRIGGERED_HALVES : SINGLE_HALVES;
    result_ =
        static_cast<uint16_t>(std::clamp<int16_t>(sample_(chip_.read(ADMUX) & ADMUX_MUX), 0, MOST));
    converting_ = true;
    first_ = false;
    chip_.write(ADCSRA, control() | ADCSRA_ADSC);
    chip_.set_alarm(Microcontroller::CONVERSION, chip_.cycle() + (halves << scale) / 2);
}

void Converter::conversion_ends() {
    const uint16_t shown =
        chip_.read(ADMUX) & ADMUX_ADLAR ? static_cast<uint16_t>(result_ << 6) : result_;
    converting_ = false;
    chip_.write(ADCL, static_cast<uint8_t>(shown));
    chip_.write(ADCH, static_cast<uint8_t>(shown >> 8));
    chip_.write(ADCSRA, control() & static_cast<uint8_t>(~ADCSRA_ADSC));
    chip_.raise_interrupt(VECTOR_ADC);
    if ((control() & ADCSRA_ADATE) != 0 && (chip_.read(ADCSRB) & ADCSRB_ADTS) == ADTS_FREE_RUNNING)
        start();
}

/// Noise-reduction sleep starts a conversion by itself, as long as the converter is on.
void Converter::quiet_sleep() {
    if ((control() & ADCSRA_ADEN) != 0 && !converting_) start();
}

void Converter::was_reset() {
    converting_ = false;
    first_ = true;
}

}  // namespace kilotwin
