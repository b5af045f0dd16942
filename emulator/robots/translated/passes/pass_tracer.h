/// Finds the path condition of a pass of a translated robot's main loop (known_pass.h).
///
/// The pass is interpreted once on a copy of the chip. Beside each concrete byte of registers,
/// stack and flags stands a symbolic one: a constant, an input (a byte as it was when the pass
/// began), or a slice of a linear form over kilo_ticks, inputs and constants. Additions,
/// differences and comparisons over several bytes make linear forms, and branches on their flags
/// make conditions. Whatever else an instruction does with a byte adds to the condition that it is
/// equal. A pass beyond that is not known: it is executed each time, as if there were no tracer.
///
/// A tick may interrupt the pass: that path is traced with kilo_ticks before the interrupt and the
/// next number behind it. The interrupt itself is traced likewise, where it requests a message of
/// the program.
///
/// Sources: pass_tracer.cpp, pass_tracer_steps.cpp (instructions).
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PASSES_PASS_TRACER_H
#define KILOTWIN_ROBOTS_TRANSLATED_PASSES_PASS_TRACER_H

#include <array>
#include <bitset>
#include <cstdint>
#include <exception>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "base/registers.h"
#include "robots/translated/interpreter.h"
#include "robots/translated/passes/known_pass.h"

namespace kilotwin {

/// The pass that begins at a chip's main loop, by what it depends on, with what becomes of it in
/// ticks; none: it changes something else, or cannot be known. `chip` has the `effects` of its
/// registers.
std::optional<KnownPass> known_pass_of(const translation_t &code, const translated_chip_t &chip);

/// The next tick's interrupt of a chip, if it asks the program for a message, of which what is
/// around it takes `sense_cycles` to find the channel free.
std::optional<KnownRequest> known_request_of(const translation_t &code,
                                             const translated_chip_t &chip, uint32_t sense_cycles);

/// One pass, or interrupt.
class PassTracer : private translated_chip_t {
  public:
    static constexpr uint32_t NO_TICK = UINT32_MAX;
    /// Flags by their bits in the status register.
    enum { CARRY = 0, ZERO = 1, NEGATIVE = 2, SIGN = 4, BIT_COPY = 6, INTERRUPTS = 7 };

    /// A chip where a pass of its main loop begins. `copies` hold the clock so far. A tick comes at
    /// the first block of code from `tick_at` cycles on.
    PassTracer(const translation_t &code, const translated_chip_t &chip,
               const std::vector<ClockCopy> &copies, uint32_t tick_at);

    struct Traced {
        PathCondition on;  ///< asked as of the last tick of the pass
        uint32_t cycles;
        uint32_t reads_from, reads_to;  ///< of KnownPass
        /// Begins of blocks up to there, of which a tick may come at each.
        std::vector<uint32_t> blocks;
        bool sets_copies;  ///< as the first pass of a tick does
    };
    /// The pass; none: it changes something else than copies, or cannot be known.
    std::optional<Traced> trace();
    /// Copies of the clock, if the first pass of a tick sets them and nothing else; or none.
    std::vector<ClockCopy> find_copies();
    /// The interrupt of the next tick, in place of a pass.
    std::optional<KnownRequest> trace_request(uint32_t sense_cycles);

  private:
    static constexpr uint16_t DATA_END = atmega328p::SRAM_END;
    static constexpr unsigned MOST_BYTES = 8;
    static constexpr uint32_t MOST_CYCLES = TICK_CYCLES / 4;
    static constexpr unsigned Z_POINTER = 30, BYTE_BITS = 8;
    static constexpr uint16_t REGISTERS_END = 0x20, IO_END = 0x100;
    /// More than passes have that only look at the time, so that no pass takes long.
    static constexpr size_t MOST_NUMBERS = 256, MOST_TERMS = 64;
    /// Sums that there are from the begin on; the copies' come next.
    enum { TICKS_BEHIND, TICKS_BEFORE, FIRST_COPY };

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
        LinearForm number;
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
    struct Failed : std::exception {};  ///< it cannot be known

    [[noreturn]] static void fail() { throw Failed{}; }
    /// The pass, then what it has left behind.
    void follow();
    void step();
    void finish();
    void finish_interrupt();
    /// Fails unless the byte at an address is what was there, and will be.
    void check(uint16_t address, const Byte &byte);
    /// True if the byte is one of a copy, which then must have been set.
    bool is_of_copy(uint16_t address, const Byte &byte);
    /// Whether it is byte `at` of kilo_ticks as they are behind the pass, and `ahead`.
    bool holds_clock(const Byte &byte, unsigned at, uint64_t ahead) const;
    void tick();
    void sense();
    uint32_t cycles() const { return static_cast<uint32_t>(MOST_CYCLES - left); }
    PathCondition path_condition();

    // By groups of instructions (pass_tracer_steps.cpp); false if it is none of these. Each says
    // where the bytes that it changes come from; interpret() then changes them.
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
    /// Whether a byte there cannot be asked for where the pass, or the interrupt, begins.
    bool has_no_place(uint16_t address) const;
    bool has_ticks(const Byte &byte) const { return byte.kind == Byte::OF_SUM && ticks_in(byte); }
    bool ticks_in(const Byte &byte) const { return sums_[byte.place].slope != 0; }
    /// Makes it one that must be equal, which fails where it depends on kilo_ticks, or on a
    /// register that has nothing in it when a pass begins. A flag asked for so becomes a constant.
    void require(Byte byte);
    void require(uint16_t address);
    void require(const LinearForm &number);
    void require(Flag &flag);
    void require_all_flags();
    /// A byte of data space. Those that a tick's interrupt changes, and registers with an effect,
    /// fail; kilo_ticks are bytes of the first sum.
    Byte load(uint16_t address);
    bool is_of_clock(uint16_t address) const;
    /// The status register as it is put together; of an interrupt it may be that before.
    Byte load_status();
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
    uint16_t new_sum(const LinearForm &number);
    Chain &chain_for(bool is_sum, bool takes_carry);
    void note(Flag &flag, unsigned bit);
    void note_bit(const Byte &byte, unsigned bit);
    void note(BranchCondition condition);

    const translation_t &code_;
    const translated_seam_t &seam_;
    const uint8_t *const before_;  ///< data space when the pass began
    const std::vector<ClockCopy> &copies_;
    const uint32_t tick_at_;
    uint32_t sense_cycles_ = 0;  ///< not 0: an interrupt is traced
    /// The stack pointer and the program counter at that moment.
    const uint16_t stack_;
    const uint32_t begin_;
    uint16_t deepest_;        ///< stack pointer
    const uint8_t bit_copy_;  ///< the flag T when the pass began
    uint32_t ticks_;          ///< at the pass's end
    bool has_ticked_;
    uint32_t block_ = 0;  ///< cycles into the pass at which the block has begun
    std::array<uint8_t, DATA_END> copy_;
    std::array<uint8_t, 8> copied_flags_;
    translated_pass_t no_pass_ = {};
    // Where each byte comes from; of memory_ those that the pass has written.
    std::array<Byte, 0x20> registers_;
    std::array<Byte, DATA_END> memory_ = {};
    std::bitset<DATA_END> written_, changed_, loaded_, equal_;
    std::vector<LinearForm> sums_;
    std::vector<bool> known_;  ///< sums whose bytes must be equal
    std::vector<Chain> chains_;
    std::vector<BranchCondition> conditions_;
    Flag carry_ = {}, zero_ = {}, signs_ = {};
    bool reads_ticks_ = false;
    /// Cycles into the pass at which the blocks begin that read kilo_ticks first and last:
    /// interrupts come where a block begins.
    uint32_t first_read_ = 0, last_read_ = 0;
    std::vector<uint32_t> blocks_;  ///< that begin behind the first
};

}  // namespace kilotwin

#endif
