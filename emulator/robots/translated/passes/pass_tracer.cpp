#include "robots/translated/passes/pass_tracer.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "base/clock.h"
#include "kilolib/core/robot_commands.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr int MOST_INSTRUCTIONS = 3000;
constexpr uint16_t INTERRUPTED = 64;  // bytes that a tick's interrupt may push
constexpr uint32_t FLASH_MASK = 0x7FFE;
constexpr uint16_t RETI = 0x9518;

/// Registers that a function may change (avr-gcc): where a pass begins nothing is in them.
constexpr bool is_scratch(uint16_t address) {
    return address == 0 || (address >= 18 && address <= 27) || address == 30 || address == 31;
}

uint8_t no_read(translated_chip_t *chip, uint16_t address) { return chip->data[address]; }
void no_write(translated_chip_t * /*chip*/, uint16_t /*address*/) {}

}  // namespace

std::optional<KnownPass> known_pass_of(const translation_t &code, const translated_chip_t &chip) {
    constexpr auto NO_TICK = PassTracer::NO_TICK;
    auto rest = PassTracer(code, chip, {}, NO_TICK).trace();
    if (!rest) return std::nullopt;
    KnownPass known = {};
    auto first = rest;
    uint32_t ticks;
    std::memcpy(&ticks, chip.data + code.seam->ticks, sizeof ticks);
    if (rest->on.lasts(chip.data, ticks) <= 1) {
        auto found = PassTracer(code, chip, {}, 0).find_copies();
        auto rest_so = PassTracer(code, chip, found, NO_TICK).trace();
        auto first_so = PassTracer(code, chip, found, 0).trace();
        const bool follow = !found.empty() && rest_so && first_so && first_so->sets_copies;
        if (follow) {
            known.copies = std::move(found);
            rest = std::move(rest_so);
            first = std::move(first_so);
        }
    }
    known.pc = chip.pc;
    known.stack = static_cast<uint16_t>(chip.data[SPL] | chip.data[SPH] << 8);
    known.status =
        static_cast<uint8_t>(chip.flags[PassTracer::BIT_COPY] << PassTracer::BIT_COPY |
                             chip.flags[PassTracer::INTERRUPTS] << PassTracer::INTERRUPTS);
    known.cycles = rest->cycles;
    known.first_cycles = first->cycles;
    known.reads_from = rest->reads_from;
    known.reads_to = rest->reads_to;
    known.rest = std::move(rest->on);
    if (!known.copies.empty()) known.add_to_first(first->on);
    for (const uint32_t block : rest->blocks) {
        if (block > known.reads_to) break;
        const auto interrupted = PassTracer(code, chip, known.copies, block).trace();
        if (!interrupted) break;
        known.add_to_first(interrupted->on);
        const bool is_over = interrupted->sets_copies || known.copies.empty();
        const uint32_t cycles = interrupted->cycles + (is_over ? 0 : known.first_cycles);
        if (cycles > UINT16_MAX) break;
        if (known.interrupted.empty() || known.interrupted.back().cycles != cycles)
            known.interrupted.push_back({0, static_cast<uint16_t>(cycles)});
        known.interrupted.back().to = static_cast<uint16_t>(block);
    }
    return known;
}

std::optional<KnownRequest> known_request_of(const translation_t &code,
                                             const translated_chip_t &chip, uint32_t sense_cycles) {
    return PassTracer(code, chip, {}, PassTracer::NO_TICK).trace_request(sense_cycles);
}

PassTracer::PassTracer(const translation_t &code, const translated_chip_t &chip,
                       const std::vector<ClockCopy> &copies, uint32_t tick_at)
    : translated_chip_t(chip),
      code_(code),
      seam_(*code.seam),
      before_(chip.data),
      copies_(copies),
      tick_at_(tick_at),
      stack_(static_cast<uint16_t>(chip.data[SPL] | chip.data[SPH] << BYTE_BITS)),
      begin_(chip.pc),
      deepest_(stack_),
      bit_copy_(chip.flags[BIT_COPY]),
      has_ticked_(tick_at == NO_TICK) {
    std::memcpy(copy_.data(), chip.data, copy_.size());
    std::memcpy(copied_flags_.data(), chip.flags, copied_flags_.size());
    std::memcpy(&ticks_, chip.data + seam_.ticks, sizeof ticks_);
    data = copy_.data();
    flags = copied_flags_.data();
    pass = &no_pass_;
    left = MOST_CYCLES;
    for (size_t at = 0; at < registers_.size(); at++)
        registers_[at] = {Byte::BEFORE, 0, static_cast<uint16_t>(at)};
    const uint64_t behind = has_ticked_ ? 0 : 1;
    ticks_ += static_cast<uint32_t>(behind);
    new_sum({1, 0, {}});
    new_sum({1, 0 - behind, {}});
    for (const ClockCopy &copy : copies_) new_sum({1, copy.ahead - behind, {}});
}

std::optional<PassTracer::Traced> PassTracer::trace() {
    try {
        follow();
        finish();
    } catch (const Failed &) {
        return std::nullopt;
    }
    unsigned set = 0, all = 0;
    for (const ClockCopy &copy : copies_)
        for (unsigned byte = 0; byte < copy.bytes; byte++) {
            set += written_[copy.address + byte];
            all++;
        }
    if (tick_at_ != NO_TICK && set != 0 && set != all) return std::nullopt;
    return Traced{path_condition(), cycles(),           first_read_,
                  last_read_,       std::move(blocks_), set == all};
}

std::vector<ClockCopy> PassTracer::find_copies() {
    std::vector<ClockCopy> found;
    try {
        follow();
    } catch (const Failed &) {
        return {};
    }
    for (uint16_t at = IO_END; at < DATA_END; at++) {
        const bool is_frame = at > deepest_ && at <= stack_;
        if (!written_[at] || is_frame || !has_ticks(memory_[at])) continue;
        const Byte byte = memory_[at];
        const LinearForm &number = sums_[byte.place];
        const bool goes_on = !found.empty() && found.back().address + found.back().bytes == at &&
                             found.back().bytes == byte.at;
        if (goes_on && holds_clock(byte, byte.at, found.back().ahead))
            found.back().bytes++;
        else if (byte.at == 0 && holds_clock(byte, 0, number.constant))
            found.push_back({at, 1, number.constant});
    }
    const auto is_late = [this](const ClockCopy &copy) { return !copy.holds(before_, ticks_ - 1); };
    const bool is_steady = std::none_of(found.begin(), found.end(), is_late);
    return is_steady && found.size() <= KnownPass::MOST_COPIES ? found : std::vector<ClockCopy>{};
}

std::optional<KnownRequest> PassTracer::trace_request(uint32_t sense_cycles) {
    constexpr int RETI_CYCLES = 4;
    sense_cycles_ = sense_cycles;
    pc = VECTOR_TIMER0_COMPA * VECTOR_BYTES;
    copied_flags_[INTERRUPTS] = 0;
    try {
        for (int left_over = MOST_INSTRUCTIONS; flash_word(flash, pc) != RETI; left_over--) {
            if (left_over == 0 || left <= 0) fail();
            step();
        }
        left -= RETI_CYCLES;
        finish_interrupt();
        if (cycles() > UINT16_MAX) fail();
    } catch (const Failed &) {
        return std::nullopt;
    }
    return KnownRequest{path_condition(), cycles()};
}

void PassTracer::follow() {
    int instructions = 0;
    do {
        if (++instructions > MOST_INSTRUCTIONS || left <= 0) fail();
        step();
    } while (pc != begin_);
    const bool is_back = pointer(SPL) == stack_ && copied_flags_[BIT_COPY] == bit_copy_;
    if (!is_back || !has_ticked_) fail();
}

/// The tick's interrupt is over: what it has done besides to count nothing reads.
void PassTracer::tick() {
    has_ticked_ = true;
    std::memcpy(&copy_[seam_.ticks], &ticks_, sizeof ticks_);
}

bool PassTracer::holds_clock(const Byte &byte, unsigned at, uint64_t ahead) const {
    if (byte.kind != Byte::OF_SUM || byte.at != at) return false;
    const LinearForm &number = sums_[byte.place];
    const uint64_t differing = number.constant ^ ahead;
    return number.slope == 1 && number.terms.empty() &&
           static_cast<uint8_t>(differing >> BYTE_BITS * at) == 0 &&
           (differing & ((uint64_t{1} << BYTE_BITS * at) - 1)) == 0;
}

bool PassTracer::is_of_copy(uint16_t address, const Byte &byte) {
    for (const ClockCopy &copy : copies_) {
        const unsigned at = address - copy.address + 0u;
        if (at >= copy.bytes) continue;
        if (!holds_clock(byte, at, copy.ahead)) fail();
        return true;
    }
    return false;
}

/// A byte that the pass has written must be the one that was there, and depend on nothing that may
/// differ.
void PassTracer::check(uint16_t address, const Byte &byte) {
    if (byte.kind == Byte::BEFORE && byte.place == address) return;
    require(byte);
    require(address);
    if (copy_[address] != before_[address]) fail();
}

/// Bytes below the stack pointer do not count; an interrupt writes some more below the lowest one.
void PassTracer::finish() {
    for (uint16_t at = 0; at < REGISTERS_END; at++)
        if (!is_scratch(at)) check(at, registers_[at]);
    for (uint16_t at = 0; at < DATA_END; at++) {
        const bool is_frame = at > deepest_ && at <= stack_;
        if (written_[at] && !is_frame && !is_of_copy(at, memory_[at])) check(at, memory_[at]);
        if (loaded_[at] && at + INTERRUPTED > deepest_ && at <= stack_) fail();
    }
    if (cycles() > UINT16_MAX) fail();
}

/// All registers have to be what they were, and the clock must have counted.
void PassTracer::finish_interrupt() {
    constexpr uint16_t CLOCK = offsetof(robot_core_t, transmit);
    if (pointer(SPL) != stack_ || deepest_ + INTERRUPTED < stack_) fail();
    for (uint16_t at = 0; at < REGISTERS_END; at++) {
        const Byte &byte = registers_[at];
        if (byte.kind != Byte::BEFORE || byte.place != at) fail();
    }
    for (uint16_t at = 0; at < DATA_END; at++) {
        const bool is_frame = at > deepest_ && at <= stack_;
        if (written_[at] && !is_frame && !is_of_clock(at)) check(at, memory_[at]);
        if (loaded_[at] && at <= stack_ && at > deepest_) fail();
    }
    for (unsigned byte = 0; byte < sizeof ticks_; byte++)
        if (!holds_clock(memory_[seam_.ticks + byte], byte, 1)) fail();
    transmit_clock_t clock;
    std::memcpy(&clock.counts, before_ + seam_.robot + CLOCK, sizeof clock.counts);
    clock.increment = before_[seam_.robot + CLOCK + offsetof(transmit_clock_t, increment)];
    transmit_clock_match(&clock);
    const uint8_t *now = &copy_[seam_.robot + CLOCK];
    if (now[0] != (clock.counts & UINT8_MAX) || now[1] != clock.counts >> BYTE_BITS ||
        now[offsetof(transmit_clock_t, increment)] != clock.increment)
        fail();
}

PathCondition PassTracer::path_condition() {
    PathCondition on;
    for (uint16_t at = 0; at < DATA_END; at++)
        if (equal_[at]) on.equal.push_back({at, before_[at]});
    on.conditions = std::move(conditions_);
    on.changes = changed_;
    const int below = std::max(deepest_ - INTERRUPTED, int{IO_END});
    for (int at = below; at <= stack_ && at < DATA_END; at++)
        on.changes.set(static_cast<size_t>(at));
    return on;
}

void PassTracer::step() {
    static constexpr registers_t REGISTERS = {no_read, no_write};
    const auto *const end = std::end(seam_.calls);
    if (std::find(std::begin(seam_.calls), end, pc) != end) return sense();
    if (code_.region_of[pc / 2] != 0) {
        block_ = cycles();
        if (reads_ticks_) blocks_.push_back(block_);
        if (!has_ticked_ && block_ >= tick_at_) tick();
    }
    const unsigned word = flash_word(flash, pc);
    if (!two_registers(word) && !immediate(word) && !pairs(word) && !one_register(word) &&
        !memory(word) && !transfer(word) && !branches(word) && !flow(word))
        fail();
    const uint32_t at = pc;
    if (!interpret(this, &REGISTERS)) fail();
    deepest_ = std::min(deepest_, pointer(SPL));
    const bool jumps = pc != ((at + 2) & FLASH_MASK) && pc != ((at + 4) & FLASH_MASK);
    if (jumps && code_.region_of[pc / 2] == 0) fail();
}

/// The engine's function that an interrupt asks before the program: nothing is received.
void PassTracer::sense() {
    constexpr unsigned RESULT = 24;
    const uint16_t stack = pointer(SPL);
    if (sense_cycles_ == 0 || pc != seam_.calls[CALL_RECEIVING] || stack + 2u > stack_) fail();
    set(RESULT), set(RESULT + 1);
    copy_[RESULT] = copy_[RESULT + 1] = 0;
    pc = (copy_[stack + 1] << BYTE_BITS | copy_[stack + 2]) * 2u;
    copy_[SPL] = static_cast<uint8_t>(stack + 2);
    copy_[SPH] = static_cast<uint8_t>((stack + 2) >> BYTE_BITS);
    left -= sense_cycles_;
}

// Where bytes come from

/// It may have become one since.
bool PassTracer::is_constant(Byte &byte) {
    const bool is_now = (byte.kind == Byte::BEFORE && equal_[byte.place]) ||
                        (byte.kind == Byte::OF_SUM && known_[byte.place]);
    if (is_now) byte = {};
    return byte.kind == Byte::CONSTANT;
}

/// Registers that have nothing in them, or where an interrupt comes may have anything.
bool PassTracer::has_no_place(uint16_t address) const {
    return is_scratch(address) || address == STATUS ||
           (sense_cycles_ != 0 && address < REGISTERS_END);
}

void PassTracer::require(uint16_t address) {
    if (has_no_place(address)) fail();
    equal_.set(address);
}

void PassTracer::require(const LinearForm &number) {
    if (number.slope != 0) fail();
    for (const auto &term : number.terms) require(term.address);
}

void PassTracer::require(Byte byte) {
    if (is_constant(byte)) return;
    if (byte.kind == Byte::BEFORE) return require(byte.place);
    require(sums_[byte.place]);
    known_[byte.place] = true;
}

void PassTracer::require(Flag &flag) {
    if (flag.kind == Flag::UNKNOWN) fail();
    if (flag.kind == Flag::OF_BYTE) require(flag.byte);
    if (flag.kind == Flag::OF_CHAIN) {
        require(chains_[flag.chain].a.number);
        require(chains_[flag.chain].b.number);
    }
    flag = PLAIN;
}

void PassTracer::require_all_flags() {
    require(carry_);
    require(zero_);
    require(signs_);
}

PassTracer::Byte PassTracer::load(uint16_t address) {
    if (address < REGISTERS_END || address >= DATA_END) fail();
    if (address < IO_END && (effects[address] & READ_EFFECT) != 0) fail();
    if (written_[address]) return memory_[address];
    const unsigned of_ticks = address - seam_.ticks;
    if (of_ticks < sizeof ticks_) {
        if (!reads_ticks_) first_read_ = block_;
        reads_ticks_ = true;
        last_read_ = block_;
        const uint16_t sum = has_ticked_ ? TICKS_BEHIND : TICKS_BEFORE;
        return {Byte::OF_SUM, static_cast<uint8_t>(of_ticks), sum};
    }
    for (size_t i = 0; i < copies_.size(); i++) {
        const unsigned at = address - copies_[i].address + 0u;
        if (at < copies_[i].bytes)
            return {Byte::OF_SUM, static_cast<uint8_t>(at), static_cast<uint16_t>(FIRST_COPY + i)};
    }
    if (is_of_clock(address)) {
        if (sense_cycles_ == 0) fail();
        return {};
    }
    loaded_.set(address);
    return {Byte::BEFORE, 0, address};
}

PassTracer::Byte PassTracer::load_status() {
    const bool is_before = sense_cycles_ != 0 && carry_.kind == Flag::UNKNOWN &&
                           zero_.kind == Flag::UNKNOWN && signs_.kind == Flag::UNKNOWN;
    if (is_before) return {Byte::BEFORE, 0, STATUS};
    require_all_flags();
    return {};
}

/// Addresses that a tick's interrupt changes.
bool PassTracer::is_of_clock(uint16_t address) const {
    constexpr uint16_t CLOCK = offsetof(robot_core_t, transmit);
    return static_cast<uint16_t>(address - seam_.ticks) < sizeof ticks_ ||
           static_cast<uint16_t>(address - (seam_.robot + CLOCK)) < sizeof(transmit_clock_t);
}

/// A register that is not plain memory must already have the byte.
void PassTracer::store(uint16_t address, Byte byte, uint8_t value) {
    if (address < REGISTERS_END || address >= DATA_END) fail();
    if (sense_cycles_ == 0 && is_of_clock(address)) fail();
    if (address < IO_END) {
        if ((effects[address] & (READ_EFFECT | WRITE_EFFECT)) != 0) fail();
        if (copy_[address] != value) fail();
        require(byte);
        require(address);
    }
    memory_[address] = byte;
    written_.set(address);
    const bool stays = byte.kind == Byte::BEFORE && byte.place == address;
    if (byte.kind != Byte::CONSTANT ? !stays : copy_[address] != value) changed_.set(address);
}

uint16_t PassTracer::pointer(unsigned pair) const {
    return static_cast<uint16_t>(copy_[pair] | copy_[pair + 1] << BYTE_BITS);
}

// Numbers

/// They are few in a pass that only looks at the time.
uint16_t PassTracer::new_sum(const LinearForm &number) {
    if (sums_.size() >= MOST_NUMBERS) fail();
    sums_.push_back(number);
    known_.push_back(false);
    return static_cast<uint16_t>(sums_.size() - 1);
}

/// The chain that an instruction goes on with, or a new one. An addition's Z is of its last byte.
PassTracer::Chain &PassTracer::chain_for(bool is_sum, bool takes_carry) {
    if (takes_carry && carry_.kind == Flag::OF_CHAIN) {
        Chain &chain = chains_[carry_.chain];
        if (chain.is_sum != is_sum || chain.bytes != carry_.bytes || chain.bytes >= MOST_BYTES)
            fail();
        const bool tells_on = zero_.kind == Flag::OF_CHAIN && zero_.chain == carry_.chain &&
                              zero_.bytes == carry_.bytes;
        chain.tells_zero = chain.tells_zero && tells_on && !is_sum;
        return chain;
    }
    if (takes_carry && carry_.kind != Flag::CONSTANT) fail();
    const uint64_t carry = takes_carry ? copied_flags_[CARRY] : 0;
    chains_.push_back({is_sum, !takes_carry, 0, carry, {}, {}, new_sum({})});
    return chains_.back();
}

/// Byte `at` of an operand, which follows those that it has.
void PassTracer::append(Operand &operand, Byte byte, uint8_t value, unsigned at) {
    const unsigned shift = at * BYTE_BITS;
    if (byte.kind == Byte::OF_SUM && byte.at == at && (at == 0 || operand.sum == byte.place)) {
        operand.sum = byte.place;
        operand.number = sums_[byte.place];
        return;
    }
    if (operand.sum >= 0) {  // of a sum only the lower bytes: it must be equal
        require(operand.number);
        const uint64_t low = (uint64_t{1} << shift) - 1;
        operand.number = {0, operand.number.value(before_, ticks_) & low, {}};
        operand.sum = -1;
    }
    if (byte.kind == Byte::OF_SUM) require(byte);
    if (byte.kind == Byte::BEFORE)
        operand.number.terms.push_back({byte.place, static_cast<uint8_t>(shift), 1});
    else
        operand.number.constant += uint64_t{value} << shift;
}

/// An addition, difference or comparison of a register and a byte.
void PassTracer::add(unsigned d, Byte b, uint8_t value, const Sum &kind) {
    Byte a = registers_[d];
    const bool is_plain = is_constant(a) && is_constant(b);
    if (is_plain && (!kind.takes_carry || carry_.kind == Flag::CONSTANT)) {
        if (kind.takes_carry && !kind.is_sum) require(zero_);
        if (kind.keeps) set(d);
        return set_flags(PLAIN);
    }
    is_constant(b);
    Chain &chain = chain_for(kind.is_sum, kind.takes_carry);
    const auto index = static_cast<uint16_t>(&chain - chains_.data());
    append(chain.a, a, copy_[d], chain.bytes);
    append(chain.b, b, value, chain.bytes);
    LinearForm sum = chain.a.number;
    sum.add(chain.b.number, kind.is_sum ? 1 : -1);
    sum.constant += kind.is_sum ? chain.carry : ~chain.carry + 1;
    if (std::abs(sum.slope) > 1 || sum.terms.size() > MOST_TERMS) fail();
    sums_[chain.result] = sum;
    known_[chain.result] = sum.slope == 0 && sum.terms.empty();
    chain.bytes++;
    const auto bytes = static_cast<uint8_t>(chain.bytes);
    if (kind.keeps) set(d, {Byte::OF_SUM, static_cast<uint8_t>(bytes - 1), chain.result});
    set_flags({Flag::OF_CHAIN, index, bytes, {}});
}

/// Slopes are those that BranchCondition can count with; what the pass found is checked once.
void PassTracer::note(BranchCondition condition) {
    for (const auto *number : {&condition.a, &condition.b}) {
        if (std::abs(number->slope) > 1) fail();
        for (const auto &term : number->terms)
            if (has_no_place(term.address)) fail();
    }
    if (std::abs(condition.a.slope - condition.b.slope) > 1) fail();
    if (condition.lasts(before_, ticks_) == 0) fail();
    conditions_.push_back(std::move(condition));
}

void PassTracer::note_bit(const Byte &byte, unsigned bit) {
    const unsigned at = byte.at * BYTE_BITS + bit;
    const LinearForm &number = sums_[byte.place];
    const bool is_set = (number.value(before_, ticks_) >> at & 1) != 0;
    note({BranchCondition::Kind::BIT,
          static_cast<uint8_t>(at + 1),
          static_cast<uint8_t>(at),
          is_set,
          number,
          {}});
}

/// A branch depends on the flag that has the number `bit` in the status register.
void PassTracer::note(Flag &flag, unsigned bit) {
    using Kind = BranchCondition::Kind;
    const bool is_sign = bit == NEGATIVE || bit == SIGN;
    if (flag.kind == Flag::OF_BYTE && has_ticks(flag.byte)) {
        if (!is_sign) fail();
        return note_bit(flag.byte, BYTE_BITS - 1);
    }
    if (flag.kind != Flag::OF_CHAIN) return require(flag);
    const Chain &chain = chains_[flag.chain];
    const LinearForm &a = chain.a.number, &b = chain.b.number;
    if (a.slope == 0 && b.slope == 0) return require(flag);
    const bool compares = !chain.is_sum && chain.carry == 0;
    const auto bits = static_cast<uint8_t>(chain.bytes * BYTE_BITS);
    const bool outcome = copied_flags_[bit] != 0;
    if (flag.bytes != chain.bytes) fail();
    if (bit == CARRY && compares) return note({Kind::LESS, bits, 0, outcome, a, b});
    if (bit == SIGN && compares) return note({Kind::LESS_SIGNED, bits, 0, outcome, a, b});
    if (bit == ZERO && chain.tells_zero)
        return note({Kind::ZERO, bits, 0, outcome, sums_[chain.result], {}});
    if (bit != NEGATIVE) fail();
    note({Kind::BIT, bits, static_cast<uint8_t>(bits - 1), outcome, sums_[chain.result], {}});
}

}  // namespace kilotwin
