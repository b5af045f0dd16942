#include "avr/boards/mcp2515.h"

#include <algorithm>

namespace kilotwin {

namespace {

// Registers and bits: datasheet, chapters 3 to 7 and 11.
enum : uint8_t {
    RXM0SIDH = 0x20,
    BFPCTRL = 0x0C,
    TXRTSCTRL = 0x0D,
    CANSTAT = 0x0E,
    CANCTRL = 0x0F,
    TEC = 0x1C,
    REC = 0x1D,
    CNF3 = 0x28,
    CNF2 = 0x29,
    CNF1 = 0x2A,
    CANINTE = 0x2B,
    CANINTF = 0x2C,
    EFLG = 0x2D,
    TXB0CTRL = 0x30,
    RXB0CTRL = 0x60,
    RXB1CTRL = 0x70,
    BUFFER_STEP = 0x10,
};
constexpr uint8_t MIRRORED = 0x0E;  // CANSTAT and CANCTRL show in every row of 16 addresses
constexpr unsigned TX_BUFFERS = 3;
// Offsets within a buffer.
constexpr unsigned CONTROL = 0, SIDH = 1, SIDL = 2, DLC = 5, DATA = 6;

constexpr uint8_t TXREQ = 1 << 3, TXP = 3, ABTF = 1 << 6;
constexpr uint8_t RXM = 3 << 5, RXM_ANY = 3 << 5, RXRTR = 1 << 3, BUKT = 1 << 2, BUKT1 = 1 << 1;
constexpr uint8_t SRR = 1 << 4, EXIDE = 1 << 3, DLC_MASK = 15;
constexpr uint8_t REQOP_SHIFT = 5, ABAT = 1 << 4;
constexpr uint8_t RX0IF = 1 << 0, RX1IF = 1 << 1, TX0IF = 1 << 2, ERRIF = 1 << 5, WAKIF = 1 << 6;
constexpr uint8_t EWARN = 1 << 0, RXWAR = 1 << 1, TXWAR = 1 << 2, RXEP = 1 << 3, TXEP = 1 << 4,
                  TXBO = 1 << 5, RX0OVR = 1 << 6, RX1OVR = 1 << 7;
constexpr uint32_t WARNING_FROM = 96, PASSIVE_FROM = 128, COUNTER_MAX = 255;

enum Instruction : uint8_t {
    WRITE = 0x02,
    READ = 0x03,
    BIT_MODIFY = 0x05,
    LOAD_TX = 0x40,  // 3 bits: buffer and place
    REQUEST = 0x80,  // 3 bits: buffers
    READ_RX = 0x90,  // 2 bits: buffer and place
    READ_STATUS = 0xA0,
    RX_STATUS = 0xB0,
    RESET = 0xC0,
};

bool is_filter_or_mask(uint8_t address) {
    return (address < 0x1C && address % 0x10 < 0x0C) || (address >= 0x20 && address < CNF3);
}

bool needs_configuration(uint8_t address) {
    return is_filter_or_mask(address) || address == TXRTSCTRL ||
           (address >= CNF3 && address <= CNF1);
}

/// Registers whose single bits the instruction BIT MODIFY can write; of others it writes all bits.
bool is_bit_modifiable(uint8_t address) {
    return address == BFPCTRL || address == TXRTSCTRL || address == CANCTRL ||
           (address >= CNF3 && address <= EFLG) || address == RXB0CTRL || address == RXB1CTRL ||
           (address >= TXB0CTRL && address < RXB0CTRL && address % BUFFER_STEP == CONTROL);
}

/// Bits that the processor may write.
uint8_t writable(uint8_t address) {
    switch (address) {
    case CANSTAT:
    case TEC:
    case REC: return 0;
    case EFLG: return RX0OVR | RX1OVR;
    case RXB0CTRL: return RXM | BUKT;
    case RXB1CTRL: return RXM;
    case TXB0CTRL:
    case TXB0CTRL + BUFFER_STEP:
    case TXB0CTRL + 2 * BUFFER_STEP: return TXREQ | TXP;
    default: return 0xFF;
    }
}

uint8_t transmit_buffer(unsigned n) { return static_cast<uint8_t>(TXB0CTRL + n * BUFFER_STEP); }
uint8_t receive_buffer(unsigned n) { return static_cast<uint8_t>(RXB0CTRL + n * BUFFER_STEP); }

}  // namespace

void Mcp2515::reset() {
    registers_.fill(0);
    registers_[CANCTRL] = 0x87;
    registers_[CANSTAT] = static_cast<uint8_t>(Mode::CONFIGURATION) << REQOP_SHIFT;
    sending_.reset();
    count_ = 0;
    instruction_ = 0;
}

Mcp2515::Mode Mcp2515::mode() const {
    return static_cast<Mode>(registers_[CANSTAT] >> REQOP_SHIFT);
}

// Bit timing: chapter 5. A bit is a synchronisation quantum and three segments.
bool Mcp2515::takes_part() const {
    const uint8_t cnf1 = registers_[CNF1], cnf2 = registers_[CNF2], cnf3 = registers_[CNF3];
    constexpr uint8_t BTLMODE = 1 << 7;
    constexpr unsigned CLOCKS_PER_BIT = 32;
    const unsigned clocks_per_quantum = 2 * ((cnf1 & 63u) + 1);
    const unsigned propagation = (cnf2 & 7u) + 1, phase_1 = (cnf2 >> 3 & 7u) + 1;
    const unsigned phase_2 = (cnf2 & BTLMODE) != 0 ? (cnf3 & 7u) + 1 : std::max(phase_1, 2u);
    const unsigned quanta = 1 + propagation + phase_1 + phase_2;
    return mode() == Mode::NORMAL && clocks_per_quantum * quanta == CLOCKS_PER_BIT;
}

// SPI

void Mcp2515::select() {
    selected_ = true;
    count_ = 0;
}

void Mcp2515::release() {
    if (!selected_) return;
    selected_ = false;
    // READ RX BUFFER ends with the buffer free again.
    if (count_ > 0 && (instruction_ & 0xF9) == READ_RX)
        registers_[CANINTF] &= static_cast<uint8_t>(~((instruction_ & 4) != 0 ? RX1IF : RX0IF));
    instruction_ = 0;
    count_ = 0;
}

uint8_t Mcp2515::exchange(uint8_t byte) {
    if (!selected_) return 0xFF;
    const unsigned at = count_++;
    if (at > 0) return data_byte(byte, at);
    begin_instruction(byte);
    return 0xFF;
}

/// The first byte of an instruction.
void Mcp2515::begin_instruction(uint8_t instruction) {
    instruction_ = instruction;
    if (instruction == RESET) {
        reset();
        selected_ = true;
        count_ = 1;
    } else if ((instruction & 0xF8) == REQUEST) {
        for (unsigned buffer = 0; buffer < TX_BUFFERS; buffer++)
            if ((instruction >> buffer & 1) != 0) request(buffer);
    } else if ((instruction & 0xF9) == READ_RX) {
        address_ = static_cast<uint8_t>(receive_buffer(instruction >> 2 & 1) +
                                        ((instruction & 2) != 0 ? DATA : SIDH));
    } else if ((instruction & 0xF8) == LOAD_TX && (instruction & 7) < 2 * TX_BUFFERS) {
        address_ = static_cast<uint8_t>(transmit_buffer(instruction >> 1 & 3) +
                                        ((instruction & 1) != 0 ? DATA : SIDH));
    }
}

/// A further byte of an instruction.
uint8_t Mcp2515::data_byte(uint8_t byte, unsigned at) {
    if ((instruction_ & 0xF9) == READ_RX) return read(address_++);
    if ((instruction_ & 0xF8) == LOAD_TX) {
        write(address_++, byte);
        return 0xFF;
    }
    switch (instruction_) {
    case READ:
        if (at == 1) address_ = byte;
        return at == 1 ? uint8_t{0xFF} : read(address_++);
    case WRITE:
        if (at == 1)
            address_ = byte;
        else
            write(address_++, byte);
        return 0xFF;
    case BIT_MODIFY:
        if (at == 1) address_ = byte & 0x7F;
        if (at == 2) mask_ = is_bit_modifiable(address_) ? byte : 0xFF;
        if (at == 3) write(address_, byte, mask_);
        return 0xFF;
    case READ_STATUS: return status();
    case RX_STATUS: return receive_status();
    default: return 0xFF;
    }
}

uint8_t Mcp2515::read(uint8_t address) const {
    address &= 0x7F;
    if (address % 0x10 >= MIRRORED) address = address % 0x10 == MIRRORED ? CANSTAT : CANCTRL;
    if (address == CANSTAT)
        return static_cast<uint8_t>((registers_[CANSTAT] & 0xE0) | interrupt_code() << 1);
    return registers_[address];
}

void Mcp2515::write(uint8_t address, uint8_t value, uint8_t mask) {
    address &= 0x7F;
    if (address % 0x10 >= MIRRORED) address = address % 0x10 == MIRRORED ? CANSTAT : CANCTRL;
    // The chip ignores writes to what must not change now.
    if (needs_configuration(address) && mode() != Mode::CONFIGURATION) return;
    const bool in_transmit_buffer = address >= TXB0CTRL && address < RXB0CTRL;
    const auto control = static_cast<uint8_t>(address - address % BUFFER_STEP);
    if (in_transmit_buffer && address != control && (registers_[control] & TXREQ) != 0) return;
    if (address > RXB0CTRL && address % BUFFER_STEP != CONTROL) return;  // received data
    mask &= writable(address);
    const uint8_t before = registers_[address];
    const auto now = static_cast<uint8_t>((before & ~mask) | (value & mask));
    if (address == CANCTRL) return write_control(now);
    registers_[address] = now;
    if (!in_transmit_buffer || address != control) return;
    if ((before & TXREQ) == 0 && (now & TXREQ) != 0)
        request((address - TXB0CTRL) / BUFFER_STEP);
    else if ((before & TXREQ) != 0 && (now & TXREQ) == 0)
        registers_[address] |= ABTF;
}

/// CANCTRL: the mode is entered at once, and ABAT takes back every request.
void Mcp2515::write_control(uint8_t value) {
    registers_[CANCTRL] = value;
    if (const auto wanted = value >> REQOP_SHIFT;
        wanted <= static_cast<uint8_t>(Mode::CONFIGURATION))
        registers_[CANSTAT] = static_cast<uint8_t>(wanted << REQOP_SHIFT);
    if ((value & ABAT) == 0) return;
    for (unsigned buffer = 0; buffer < TX_BUFFERS; buffer++) {
        uint8_t &control = registers_[transmit_buffer(buffer)];
        if ((control & TXREQ) != 0) control = static_cast<uint8_t>((control & ~TXREQ) | ABTF);
    }
}

/// READ STATUS: two bits for the receive buffers, then request and done of each transmit buffer.
uint8_t Mcp2515::status() const {
    const uint8_t flags = registers_[CANINTF];
    auto status = static_cast<uint8_t>(flags & (RX0IF | RX1IF));
    for (unsigned buffer = 0; buffer < TX_BUFFERS; buffer++) {
        const bool requested = (registers_[transmit_buffer(buffer)] & TXREQ) != 0;
        const bool gone = (flags & TX0IF << buffer) != 0;
        status = static_cast<uint8_t>(status | (requested | gone << 1) << (2 + 2 * buffer));
    }
    return status;
}

/// RX STATUS: full buffers, kind of frame and the filter that it passed.
uint8_t Mcp2515::receive_status() const {
    const unsigned full = registers_[CANINTF] & (RX0IF | RX1IF);
    if (full == 0) return 0;
    const unsigned buffer = (full & RX0IF) != 0 ? 0 : 1;
    const uint8_t control = registers_[receive_buffer(buffer)];
    unsigned filter = buffer == 0 ? control & 1u : control & 7u;
    // Frames that rolled over from buffer 0.
    if (buffer == 1 && filter < 2) filter += 6;
    return static_cast<uint8_t>(full << 6 | ((control & RXRTR) != 0 ? 1u << 3 : 0) | filter);
}

// Interrupts

void Mcp2515::flag(uint8_t bits) { registers_[CANINTF] |= bits; }

bool Mcp2515::interrupts() const { return (registers_[CANINTE] & registers_[CANINTF]) != 0; }

/// ICOD of CANSTAT: the pending interrupt of highest priority.
uint8_t Mcp2515::interrupt_code() const {
    static constexpr std::array<uint8_t, 7> ORDER = {ERRIF,      WAKIF, TX0IF, TX0IF << 1,
                                                     TX0IF << 2, RX0IF, RX1IF};
    const uint8_t pending = registers_[CANINTE] & registers_[CANINTF];
    for (size_t i = 0; i < ORDER.size(); i++)
        if ((pending & ORDER[i]) != 0) return static_cast<uint8_t>(i + 1);
    return 0;
}

void Mcp2515::set_errors(uint32_t transmit, uint32_t receive, bool bus_off) {
    registers_[TEC] = static_cast<uint8_t>(std::min(transmit, COUNTER_MAX));
    registers_[REC] = static_cast<uint8_t>(std::min(receive, COUNTER_MAX));
    unsigned flags = registers_[EFLG] & (RX0OVR | RX1OVR);
    if (transmit >= WARNING_FROM) flags |= TXWAR | EWARN;
    if (receive >= WARNING_FROM) flags |= RXWAR | EWARN;
    if (transmit >= PASSIVE_FROM) flags |= TXEP;
    if (receive >= PASSIVE_FROM) flags |= RXEP;
    if (bus_off) flags |= TXBO;
    if (flags != registers_[EFLG]) flag(ERRIF);
    registers_[EFLG] = static_cast<uint8_t>(flags);
}

// Sending

/// Sets a transmit buffer's request. In loopback mode its frame is received at once.
void Mcp2515::request(unsigned buffer) {
    uint8_t &control = registers_[transmit_buffer(buffer)];
    control = static_cast<uint8_t>((control & TXP) | TXREQ);
    if (mode() != Mode::LOOPBACK) return;
    if (const auto frame = next_to_send()) {
        accept(*frame);
        sent();
    }
}

std::optional<CanFrame> Mcp2515::next_to_send() {
    if (sending_ || (mode() != Mode::LOOPBACK && !takes_part())) return std::nullopt;
    std::optional<unsigned> first;
    unsigned highest = 0;
    // Equal priorities: the higher buffer number wins.
    for (unsigned buffer = 0; buffer < TX_BUFFERS; buffer++) {
        const uint8_t control = registers_[transmit_buffer(buffer)];
        if ((control & TXREQ) == 0 || (first && (control & TXP) < highest)) continue;
        first = buffer;
        highest = control & TXP;
    }
    if (!first) return std::nullopt;
    sending_ = first;
    const uint8_t *bytes = &registers_[transmit_buffer(*first)];
    constexpr uint8_t RTR = 1 << 6;
    CanFrame frame;
    frame.id = static_cast<uint16_t>(bytes[SIDH] << 3 | bytes[SIDL] >> 5);
    frame.rtr = (bytes[DLC] & RTR) != 0;
    frame.dlc = std::min<uint8_t>(bytes[DLC] & DLC_MASK, CanFrame::DATA_MAX);
    if (!frame.rtr) std::copy_n(bytes + DATA, frame.dlc, frame.data.begin());
    return frame;
}

void Mcp2515::sent() {
    if (!sending_) return;
    registers_[transmit_buffer(*sending_)] &= static_cast<uint8_t>(~TXREQ);
    flag(static_cast<uint8_t>(TX0IF << *sending_));
    sending_.reset();
}

// Receiving

void Mcp2515::receive(const CanFrame &frame) {
    if (mode() == Mode::SLEEP) {
        // The frame that wakes the chip is not received.
        flag(WAKIF);
        if ((registers_[CANINTE] & WAKIF) != 0)
            registers_[CANSTAT] = static_cast<uint8_t>(Mode::LISTEN_ONLY) << REQOP_SHIFT;
        return;
    }
    if (takes_part() || mode() == Mode::LISTEN_ONLY) accept(frame);
}

/// Whether the frame passes a filter on the bits that the mask selects. Of standard frames, the
/// bits for an extended identifier apply to the first two data bytes.
bool Mcp2515::passes(unsigned filter, unsigned mask, const CanFrame &frame) const {
    const uint8_t *wanted = &registers_[4 * filter + (filter < 3 ? 0u : 4u)];
    const uint8_t *care = &registers_[RXM0SIDH + 4 * mask];
    if ((wanted[1] & EXIDE) != 0) return false;
    if (((wanted[0] ^ frame.id >> 3) & care[0]) != 0) return false;
    if (((wanted[1] ^ frame.id << 5) & care[1] & 0xE0) != 0) return false;
    if (frame.rtr) return true;
    for (unsigned i = 0; i < 2; i++)
        if (i < frame.dlc && ((wanted[2 + i] ^ frame.data[i]) & care[2 + i]) != 0) return false;
    return true;
}

/// The first filter of a receive buffer that the frame passes.
std::optional<unsigned> Mcp2515::filter_of(unsigned buffer, const CanFrame &frame) const {
    const unsigned first = buffer == 0 ? 0 : 2, last = buffer == 0 ? 1 : 5;
    if ((registers_[receive_buffer(buffer)] & RXM) == RXM_ANY) return first;
    for (unsigned filter = first; filter <= last; filter++)
        if (passes(filter, buffer, frame)) return filter;
    return std::nullopt;
}

/// Stores a frame in the buffer whose filters it passes; buffer 0 comes first and may roll over.
void Mcp2515::accept(const CanFrame &frame) {
    const bool full_0 = (registers_[CANINTF] & RX0IF) != 0,
               full_1 = (registers_[CANINTF] & RX1IF) != 0;
    auto overflow = [this](uint8_t bit) {
        registers_[EFLG] |= bit;
        flag(ERRIF);
        missed_++;
    };
    if (const auto filter = filter_of(0, frame)) {
        if (!full_0) return store(0, *filter, frame);
        if ((registers_[RXB0CTRL] & BUKT) == 0) return overflow(RX0OVR);
        if (full_1) return overflow(RX1OVR);
        return store(1, *filter, frame);
    }
    if (const auto filter = filter_of(1, frame)) {
        if (full_1) return overflow(RX1OVR);
        store(1, *filter, frame);
    }
}

/// Bits of a buffer's control that are the program's own stay; the others describe the frame.
void Mcp2515::store(unsigned buffer, unsigned filter, const CanFrame &frame) {
    uint8_t *bytes = &registers_[receive_buffer(buffer)];
    const unsigned kept = bytes[CONTROL] & (RXM | (buffer == 0 ? BUKT : 0));
    const unsigned copy = buffer == 0 && (kept & BUKT) != 0 ? BUKT1 : 0;
    bytes[CONTROL] = static_cast<uint8_t>(kept | copy | (frame.rtr ? RXRTR : 0) | filter);
    bytes[SIDH] = static_cast<uint8_t>(frame.id >> 3);
    bytes[SIDL] = static_cast<uint8_t>(frame.id << 5 | (frame.rtr ? SRR : 0));
    bytes[SIDL + 1] = bytes[SIDL + 2] = 0;
    bytes[DLC] = frame.dlc;
    std::copy(frame.data.begin(), frame.data.end(), bytes + DATA);
    flag(buffer == 0 ? RX0IF : RX1IF);
}

}  // namespace kilotwin
