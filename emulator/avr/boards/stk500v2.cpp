#include "avr/boards/stk500v2.h"

#include <algorithm>
#include <iterator>
#include <string_view>

namespace kilotwin {

namespace {

constexpr uint8_t MESSAGE_START = 0x1B, MESSAGE_TOKEN = 0x0E;

namespace command {
enum : uint8_t {
    SIGN_ON = 0x01,
    SET_PARAMETER = 0x02,
    GET_PARAMETER = 0x03,
    LOAD_ADDRESS = 0x06,
    ENTER_PROGRAMMING = 0x10,
    LEAVE_PROGRAMMING = 0x11,
    CHIP_ERASE = 0x12,
    PROGRAM_FLASH = 0x13,
    READ_FLASH = 0x14,
    PROGRAM_EEPROM = 0x15,
    READ_EEPROM = 0x16,
    PROGRAM_FUSE = 0x17,
    READ_FUSE = 0x18,
    PROGRAM_LOCK = 0x19,
    READ_LOCK = 0x1A,
    READ_SIGNATURE = 0x1B,
    READ_CALIBRATION = 0x1C,
    SPI_MULTI = 0x1D,
    WRONG_CHECKSUM = 0xB0  // as an answer only
};
}  // namespace command
enum Status : uint8_t {
    OK = 0x00,
    TIME_OUT = 0x80,
    FAILED = 0xC0,
    CHECKSUM_ERROR = 0xC1,
    UNKNOWN = 0xC9
};

struct Parameter {
    uint8_t number, value;
};
constexpr uint8_t CLOCK_DURATION = 0x98;
// Build and hardware numbers, the firmware's version, 3.3 V at the chip, reset active low.
constexpr Parameter PARAMETERS[] = {{0x80, 0}, {0x81, 1},  {0x90, 15},
                                    {0x91, 2}, {0x92, 10}, {0x94, 33},
                                    {0x95, 0}, {0x9E, 1},  {CLOCK_DURATION, 0}};

// Bits of the mode of a memory's write: by pages, and whether the page is complete.
constexpr uint8_t BY_PAGES = 1 << 0, PAGE_ENDS = 1 << 7;
constexpr uint8_t HIGH_BYTE = 1 << 3;  // of an instruction for a byte of the flash
constexpr size_t INSTRUCTION_BYTES = 4;
constexpr size_t DATA_AT = 10, READ_BODY = 4;  // of the messages that write and read a memory

/// Least length of a command's body; 0: there is no such command.
size_t least_length(uint8_t command) {
    switch (command) {
    case command::SIGN_ON: return 1;
    case command::GET_PARAMETER: return 2;
    case command::SET_PARAMETER:
    case command::LEAVE_PROGRAMMING: return 3;
    case command::READ_FLASH:
    case command::READ_EEPROM:
    case command::SPI_MULTI: return READ_BODY;
    case command::LOAD_ADDRESS:
    case command::PROGRAM_FUSE:
    case command::PROGRAM_LOCK: return 1 + INSTRUCTION_BYTES;
    case command::READ_FUSE:
    case command::READ_LOCK:
    case command::READ_SIGNATURE:
    case command::READ_CALIBRATION: return 2 + INSTRUCTION_BYTES;
    case command::CHIP_ERASE: return 3 + INSTRUCTION_BYTES;
    case command::PROGRAM_FLASH:
    case command::PROGRAM_EEPROM: return DATA_AT;
    case command::ENTER_PROGRAMMING: return 8 + INSTRUCTION_BYTES;
    default: return 0;
    }
}

}  // namespace

Stk500v2::Message Stk500v2::receive(std::span<const uint8_t> bytes) {
    Message answers;
    for (uint8_t byte : bytes) {
        if (!take(byte)) continue;
        const Message framed_answer =
            framed(checksum_ == 0 ? answer() : Message{command::WRONG_CHECKSUM, CHECKSUM_ERROR});
        answers.insert(answers.end(), framed_answer.begin(), framed_answer.end());
    }
    return answers;
}

void Stk500v2::hang_up() {
    state_ = START;
    chip_.reset();
}

/// Whether a message has ended with `byte`; its bytes all together give a checksum of 0.
bool Stk500v2::take(uint8_t byte) {
    checksum_ = state_ == START ? byte : checksum_ ^ byte;
    switch (state_) {
    case START: state_ = byte == MESSAGE_START ? SEQUENCE : START; break;
    case SEQUENCE:
        sequence_ = byte;
        state_ = SIZE_HIGH;
        break;
    case SIZE_HIGH:
        size_ = size_t{byte} << 8;
        state_ = SIZE_LOW;
        break;
    case SIZE_LOW:
        size_ |= byte;
        state_ = size_ > 0 && size_ <= BODY_MOST ? TOKEN : START;
        break;
    case TOKEN:
        body_.clear();
        state_ = byte == MESSAGE_TOKEN ? BODY : START;
        break;
    case BODY:
        body_.push_back(byte);
        if (body_.size() == size_) state_ = CHECKSUM;
        break;
    case CHECKSUM: state_ = START; return true;
    }
    return false;
}

Stk500v2::Message Stk500v2::framed(const Message &body) const {
    Message message = {MESSAGE_START, sequence_, static_cast<uint8_t>(body.size() >> 8),
                       static_cast<uint8_t>(body.size()), MESSAGE_TOKEN};
    std::ranges::copy(body, std::back_inserter(message));
    uint8_t checksum = 0;
    for (uint8_t byte : message) checksum ^= byte;
    message.push_back(checksum);
    return message;
}

Stk500v2::Message Stk500v2::answer() {
    constexpr std::string_view NAME = "AVRISP_2";
    const size_t least = least_length(body_[0]);
    if (least == 0) return status(UNKNOWN);
    if (body_.size() < least) return status(FAILED);
    switch (body_[0]) {
    case command::SIGN_ON: {
        Message hello = {command::SIGN_ON, OK, static_cast<uint8_t>(NAME.size())};
        hello.insert(hello.end(), NAME.begin(), NAME.end());
        return hello;
    }
    case command::SET_PARAMETER: return set_parameter();
    case command::GET_PARAMETER: return parameter();
    case command::LOAD_ADDRESS:
        address_ = 0;
        for (size_t i = 1; i <= INSTRUCTION_BYTES; i++) address_ = address_ << 8 | body_[i];
        return status(OK);
    case command::ENTER_PROGRAMMING: return enter();
    case command::LEAVE_PROGRAMMING: chip_.reset(); return status(OK);
    case command::SPI_MULTI: return exchange();
    default: return chip_.enabled() ? answer_about_chip() : status(FAILED);
    }
}

/// Commands for a chip that is ready to be programmed.
Stk500v2::Message Stk500v2::answer_about_chip() {
    switch (body_[0]) {
    case command::CHIP_ERASE: shift_from_body(3); return status(OK);
    case command::PROGRAM_FLASH: return write_memory(true);
    case command::PROGRAM_EEPROM: return write_memory(false);
    case command::READ_FLASH: return read_memory(true);
    case command::READ_EEPROM: return read_memory(false);
    case command::PROGRAM_FUSE:
    case command::PROGRAM_LOCK: shift_from_body(1); return {body_[0], OK, OK};
    default: return read_one();
    }
}

Stk500v2::Message Stk500v2::set_parameter() {
    const bool known = std::any_of(std::begin(PARAMETERS), std::end(PARAMETERS),
                                   [&](const Parameter &p) { return p.number == body_[1]; });
    if (body_[1] == CLOCK_DURATION) clock_duration_ = body_[2];
    return status(known ? OK : FAILED);
}

Stk500v2::Message Stk500v2::parameter() const {
    if (body_[1] == CLOCK_DURATION) return {command::GET_PARAMETER, OK, clock_duration_};
    for (const auto &[number, value] : PARAMETERS)
        if (number == body_[1]) return {command::GET_PARAMETER, OK, value};
    return status(FAILED);
}

/// Pulses reset and asks the chip to be programmed; it has accepted if the byte that the PC named
/// comes out where the PC looks for it.
Stk500v2::Message Stk500v2::enter() {
    const uint8_t wanted = body_[6], place = body_[7];
    chip_.reset();
    const auto out = shift_from_body(8);
    const bool accepted =
        chip_.enabled() && (place == 0 || (place <= out.size() && out[place - 1] == wanted));
    if (!accepted) chip_.reset();
    return status(accepted ? OK : TIME_OUT);
}

/// Bytes in pages: each is loaded, then the page is written. EEPROM also byte by byte.
Stk500v2::Message Stk500v2::write_memory(bool flash) {
    const size_t count = size_t{body_[1]} << 8 | body_[2];
    const uint8_t mode = body_[3], load = body_[5], write = body_[6];
    if (count != body_.size() - DATA_AT) return status(FAILED);
    const uint32_t begin = address_;
    for (size_t i = 0; i < count; i++) {
        const uint8_t high = flash && i % 2 == 1 ? HIGH_BYTE : 0;
        shift(load | high, address_, body_[DATA_AT + i]);
        if (!flash || i % 2 == 1) address_++;
    }
    if ((mode & BY_PAGES) != 0 && (mode & PAGE_ENDS) != 0) shift(write, begin, 0);
    return status(OK);
}

Stk500v2::Message Stk500v2::read_memory(bool flash) {
    const size_t count = size_t{body_[1]} << 8 | body_[2];
    if (count > BODY_MOST - 3) return status(FAILED);
    Message data = {body_[0], OK};
    for (size_t i = 0; i < count; i++) {
        const uint8_t high = flash && i % 2 == 1 ? HIGH_BYTE : 0;
        data.push_back(shift(body_[3] | high, address_, 0));
        if (!flash || i % 2 == 1) address_++;
    }
    data.push_back(OK);
    return data;
}

/// One byte of fuses, lock bits or signature: that which comes out while the byte of the
/// instruction is shifted in that the PC counts from 1.
Stk500v2::Message Stk500v2::read_one() {
    const auto out = shift_from_body(2);
    if (body_[1] == 0 || body_[1] > out.size()) return status(FAILED);
    return {body_[0], OK, out[body_[1] - 1], OK};
}

/// Any bytes for the SPI, of which the chip takes four at a time; returns a stretch of what comes
/// out.
Stk500v2::Message Stk500v2::exchange() {
    const size_t sent = body_[1], wanted = body_[2], first = body_[3];
    if (sent != body_.size() - READ_BODY) return status(FAILED);
    Message out;
    for (size_t at = 0; at < std::max(sent, first + wanted); at += INSTRUCTION_BYTES) {
        const auto bytes = shift_from_body(READ_BODY + at);
        out.insert(out.end(), bytes.begin(), bytes.end());
    }
    out.resize(std::max(out.size(), first + wanted));
    Message data = {command::SPI_MULTI, OK};
    data.insert(data.end(), out.begin() + static_cast<std::ptrdiff_t>(first),
                out.begin() + static_cast<std::ptrdiff_t>(first + wanted));
    data.push_back(OK);
    return data;
}

/// Shifts four bytes of the message; 0 where it has ended.
SerialProgramming::Bytes Stk500v2::shift_from_body(size_t at) {
    SerialProgramming::Bytes instruction{};
    for (size_t i = 0; i < INSTRUCTION_BYTES && at + i < body_.size(); i++)
        instruction[i] = body_[at + i];
    return chip_.shift(instruction);
}

/// Shifts an instruction with an address of 16 bits; returns what is read.
uint8_t Stk500v2::shift(uint8_t first, uint32_t address, uint8_t value) {
    return chip_.shift(
        {first, static_cast<uint8_t>(address >> 8), static_cast<uint8_t>(address), value})[3];
}

}  // namespace kilotwin
