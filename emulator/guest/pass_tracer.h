/// Finds out what a pass of a translated robot's main loop depends on (known_pass.h).
///
/// The pass is executed once, instruction by instruction, on a copy of the chip, and beside each
/// byte of registers, stack and flags stands where it comes from: a constant, a byte as it was when
/// the pass began, or a byte of a sum of kilo_ticks, such bytes and constants. Additions,
/// differences and comparisons over several bytes make such sums, and branches on their flags
/// conditions; whatever else an instruction does with a byte makes it one that must be equal.
/// A pass beyond that is not known: it is executed each time, as if there were no tracer.
#ifndef KILOTWIN_GUEST_PASS_TRACER_H
#define KILOTWIN_GUEST_PASS_TRACER_H

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/registers.h"
#include "guest/interpreter.h"
#include "guest/known_pass.h"

namespace kilotwin {

/// One pass.
class PassTracer : private translated_chip_t {
  public:
    /// A chip where a pass of its main loop begins; `effects` of its registers by address.
    PassTracer(const translation_t &code, const translated_chip_t &chip);

    /// The pass by what it depends on; none: it changes something, or cannot be known.
    std::optional<KnownPass> trace();

  private:
    static constexpr uint16_t DATA_END = atmega328p::SRAM_END;
    static constexpr unsigned MOST_BYTES = 8;
    /// More than passes have that only look at the time, so that no pass takes long.
    static constexpr size_t MOST_NUMBERS = 256, MOST_TERMS = 64;

    /// Where a byte comes from.
    struct Byte {
        enum Kind : uint8_t {
            CONSTANT,
            BEFORE,  ///< what was at `place` when the pass began
            OF_SUM   ///< byte `at` of sum number `place`
        };
        Kind kind;
        uint8_t at;
        uint16_t place;
    };

    /// One of the two numbers of an addition or difference, as far as its bytes are known.
    struct Operand {
        TickNumber number;
        int sum = -1;  ///< all bytes are those of that sum; -1: of none
    };

    /// An addition or a difference over several bytes, from the lowest on.
    struct Chain {
        bool is_sum;
        bool tells_zero;  ///< the flag Z is of all bytes
        unsigned bytes = 0;
        uint64_t carry;  ///< into the lowest byte
        Operand a, b;
        uint16_t result;  ///< number of the sum
    };

    /// The origin of a flag: a constant, the last byte of a chain, or a byte. Where a pass begins
    /// nothing is known of the flags, since nothing reads them.
    struct Flag {
        enum Kind : uint8_t { UNKNOWN, CONSTANT, OF_CHAIN, OF_BYTE };
        Kind kind;
        uint16_t chain;
        uint8_t bytes;
        Byte byte;
    };

    /// An addition or a difference; whether it takes the carry, and whether the result is kept.
    struct Sum {
        bool is_sum, takes_carry, keeps;
    };

    /// The end of a trace in the midst of an instruction: few passes are traced, so it may cost.
    struct Failed {};  ///< thrown: it cannot be known

    [[noreturn]] static void fail() { throw Failed{}; }
    /// The pass, then what it has left behind.
    void follow();
    void step();
    void finish(KnownPass &known);

    // By groups of instructions; false if it is none of these. Each says where the bytes that it
    // changes come from; interpret() then changes them.
    bool two_registers(unsigned word);
    bool immediate(unsigned word);
    bool pairs(unsigned word);
    bool one_register(unsigned word);
    bool memory(unsigned word);
    bool transfer(unsigned word);
    bool branches(unsigned word);
    bool flow(unsigned word);

    /// Flags' and registers' bytes.
    /// Also one that has to be equal by now: then `byte` becomes a constant.
    bool is_constant(Byte &byte);
    bool has_ticks(const Byte &byte) const { return byte.kind == Byte::OF_SUM && ticks_in(byte); }
    bool ticks_in(const Byte &byte) const { return sums_[byte.place].slope != 0; }
    /// Makes it one that must be equal, which fails where it depends on kilo_ticks, or on a
    /// register that has nothing in it when a pass begins. A flag asked for so becomes a constant.
    void require(Byte byte);
    void require(uint16_t address);
    void require(const TickNumber &number);
    void require(Flag &flag);
    void require_all_flags();
    /// A byte of data space. Those that a tick's interrupt changes, and registers with an effect,
    /// fail; kilo_ticks are bytes of the first sum.
    Byte load(uint16_t address);
    bool is_of_clock(uint16_t address) const;
    /// To data space; a register that is not plain memory must have the byte already.
    void store(uint16_t address, Byte byte, uint8_t value);
    /// The address in a pair of registers, or in the stack pointer.
    uint16_t pointer(unsigned pair) const;
    void set(unsigned reg, Byte byte = Byte{}) { registers_[reg] = byte; }
    void set_flags(Flag flag) { carry_ = zero_ = signs_ = flag; }
    static constexpr Flag PLAIN = {Flag::CONSTANT, 0, 0, {Byte::CONSTANT, 0, 0}};

    // Numbers. add() is each addition, difference and comparison: it goes on with the chain of the
    // carry that it takes, or begins one. note() makes a condition of what a branch asks for, if
    // that depends on kilo_ticks; if not, the bytes must be equal.
    void add(unsigned d, Byte b, uint8_t value, const Sum &kind);
    /// Gives an operand its byte number `at`, of which `value` is what the pass found.
    void append(Operand &operand, Byte byte, uint8_t value, unsigned at);
    uint16_t new_sum(const TickNumber &number);
    Chain &chain_for(bool is_sum, bool takes_carry);
    void note(Flag &flag, unsigned bit);
    void note_bit(const Byte &byte, unsigned bit);
    void note(TickCondition condition);

    const translation_t &code_;
    const translated_seam_t &seam_;
    const uint8_t *const before_;  ///< data space when the pass began
    /// The stack pointer and the program counter at that moment.
    const uint16_t stack_;
    const uint32_t begin_;
    uint16_t deepest_;        ///< stack pointer
    const uint8_t bit_copy_;  ///< the flag T when the pass began
    uint32_t ticks_;
    uint32_t block_ = 0;  ///< cycles into the pass at which the block has begun
    std::array<uint8_t, DATA_END> copy_;
    std::array<uint8_t, 8> copied_flags_;
    translated_pass_t no_pass_ = {};
    // Where each byte comes from; of memory_ those that the pass has written.
    std::array<Byte, 0x20> registers_;
    std::array<Byte, DATA_END> memory_ = {};
    std::bitset<DATA_END> written_, loaded_, equal_;
    std::vector<TickNumber> sums_;  ///< the first is kilo_ticks
    std::vector<bool> known_;       ///< sums whose bytes must be equal
    std::vector<Chain> chains_;
    std::vector<TickCondition> conditions_;
    Flag carry_ = {}, zero_ = {}, signs_ = {};
    bool reads_ticks_ = false;
    /// Cycles into the pass at which the blocks begin that read kilo_ticks first and last:
    /// interrupts come where a block begins.
    uint32_t first_read_ = 0, last_read_ = 0;
};

}  // namespace kilotwin

#endif
