#include "avr/boards/twi_master.h"

#include "base/registers.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// Status codes in TWSR (datasheet, tables 22-2 and 22-3).
enum Status : uint8_t {
    STARTED = 0x08,
    STARTED_AGAIN = 0x10,
    ADDRESS_WRITE = 0x18,  // acknowledged; not acknowledged: 8 more
    DATA_SENT = 0x28,
    ADDRESS_READ = 0x40,
    DATA_READ = 0x50,
    NO_STATE = 0xF8,
};
constexpr uint8_t NOT_ACKNOWLEDGED = 8;
constexpr unsigned BYTE_BITS = 9, CONDITION_BITS = 1;

}  // namespace

TwiMaster::TwiMaster(Microcontroller &chip, Pca9635 &device) : chip_(chip), device_(device) {
    for (uint16_t address : {TWBR, TWSR, TWDR, TWCR}) chip_.take_over(address);
    chip_.watch_register(TWCR, Microcontroller::Watch::WRITES);
    was_reset();
}

void TwiMaster::was_reset() {
    step_ = Step::NOTHING;
    owns_bus_ = addressed_ = reads_ = starts_after_stop_ = false;
    chip_.write(TWSR, NO_STATE);
    chip_.write(TWDR, 0xFF);
}

uint8_t TwiMaster::control() const { return chip_.read(TWCR); }

/// Writing a one to TWINT clears it and begins the next step.
void TwiMaster::control_written() {
    const uint8_t written = control();
    if ((written & TWCR_TWEN) == 0) {
        step_ = Step::NOTHING;
        owns_bus_ = addressed_ = false;
        chip_.set_alarm(Microcontroller::TWO_WIRE, Microcontroller::NO_ALARM);
        return;
    }
    if ((written & TWCR_TWINT) == 0) return;
    chip_.clear_interrupt(VECTOR_TWI);
    chip_.write(TWCR, written & static_cast<uint8_t>(~TWCR_TWINT));
    if ((written & TWCR_TWSTO) != 0) {
        starts_after_stop_ = (written & TWCR_TWSTA) != 0;
        begin(Step::STOP, CONDITION_BITS);
    } else if ((written & TWCR_TWSTA) != 0) {
        status_ = owns_bus_ ? STARTED_AGAIN : STARTED;
        begin(Step::START, CONDITION_BITS);
    } else if (owns_bus_) {
        begin(!addressed_ ? Step::ADDRESS : reads_ ? Step::READ : Step::WRITE, BYTE_BITS);
    }
}

void TwiMaster::begin(Step step, unsigned bits) {
    step_ = step;
    const unsigned prescaler = 1u << 2 * (chip_.read(TWSR) & TWSR_TWPS);
    // Cycles per bit (datasheet, bit rate generator unit).
    const unsigned bit = 16 + 2u * chip_.read(TWBR) * prescaler;
    chip_.set_alarm(Microcontroller::TWO_WIRE, chip_.cycle() + bits * bit);
}

/// The device answers when a step is over; TWINT then tells the program.
void TwiMaster::step_ends() {
    const Step done = step_;
    step_ = Step::NOTHING;
    auto acknowledged = [this](bool ack, Status status) {
        status_ = static_cast<uint8_t>(status + (ack ? 0 : NOT_ACKNOWLEDGED));
    };
    switch (done) {
    case Step::START:
        owns_bus_ = true;
        addressed_ = false;
        break;
    case Step::ADDRESS: {
        const uint8_t byte = chip_.read(TWDR);
        addressed_ = true;
        reads_ = (byte & 1) != 0;
        acknowledged(device_.address(byte), reads_ ? ADDRESS_READ : ADDRESS_WRITE);
        break;
    }
    case Step::WRITE: acknowledged(device_.write(chip_.read(TWDR)), DATA_SENT); break;
    case Step::READ:
        chip_.write(TWDR, device_.read());
        acknowledged((control() & TWCR_TWEA) != 0, DATA_READ);
        break;
    case Step::STOP:
        device_.stop();
        owns_bus_ = addressed_ = false;
        chip_.write(TWCR, control() & static_cast<uint8_t>(~TWCR_TWSTO));
        chip_.write(TWSR, static_cast<uint8_t>(NO_STATE | (chip_.read(TWSR) & TWSR_TWPS)));
        if (starts_after_stop_) {
            status_ = STARTED;
            begin(Step::START, CONDITION_BITS);
        }
        return;
    case Step::NOTHING: return;
    }
    chip_.write(TWSR, static_cast<uint8_t>(status_ | (chip_.read(TWSR) & TWSR_TWPS)));
    chip_.raise_interrupt(VECTOR_TWI);
}

}  // namespace kilotwin
