/// A robot as a translated guest: its machine code, made by avr-gcc as for the robot, is executed
/// as code of this computer with each cycle counted, and the engine plays what is around it.
///
/// The image is the one that would be flashed: all of its kilolib that decides something is
/// executed. The engine takes the place of peripherals: timer 0 and its interrupt, EEPROM, serial
/// line, registers of motors and LED; and of the five functions of translated_seam_t, which
/// send frames, sense light and convert voltages. A frame that is received becomes a call of the
/// program's callback, or of kilolib's commands, as in the comparator's interrupt.
///
/// Interrupts are served where a block of code ends, so at or a few cycles after their moment, as
/// in a chip between two instructions. How far the robot is run at once changes nothing: a run ends
/// where a block does, and what lies beyond `until` is not looked at.
///
/// A pass of the main loop, or of a loop that waits, that has left registers and variables as they
/// were would do so again: such passes are left out up to the next interrupt, by arithmetic.
/// Bytes below the stack pointer do not count, and a pass in which a function returned to before
/// its begin is none: who calls it the next time may be another. Both the code's main region and
/// note_pass() look for them; the region goes on by itself where an interrupt ends the repetition,
/// and comes back here where the run does.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_ROBOT_H
#define KILOTWIN_ROBOTS_TRANSLATED_ROBOT_H

#include <cstddef>
#include <cstring>
#include <optional>

#include "base/board_clock.h"
#include "kilolib/core/infrared_frame.h"
#include "robots/record.h"
#include "robots/translated/debugging.h"
#include "robots/translated/interpreter.h"
#include "robots/translated/program.h"
#include "robots/translated/state.h"
#include "robots/translated/written_bytes.h"

namespace kilotwin {

/// One run of a robot.
///
/// Sources: translated/robot.cpp (running, loops, interrupts), translated/rest.cpp (ticks in which
/// nothing changes), translated/calls.cpp (the engine's functions, commands and messages),
/// translated/held_back.cpp (interrupts that the program does not let through),
/// translated/mistakes.cpp, translated/lost_edges.cpp, translated/registers.cpp.
class TranslatedRobot : private translated_chip_t {
  public:
    TranslatedRobot(TranslatedProgram &program, RobotRecord &robot, TranslatedState &state);

    /// Executes up to the robot's until_, or to a question.
    void run();

  private:
    using Interrupt = TranslatedImage::Interrupt;

    /// An interrupt that has begun before the end of a run is executed so far beyond, since nothing
    /// reaches it: the channel is asked as of the interrupt's begin.
    static constexpr uint64_t INTERRUPT_BEYOND = 1024;
    /// So long an edge waits at most for the end of a block of code.
    static constexpr uint64_t LONGEST_BLOCK = 128;
    /// Where a message's callback returns to: the last word of the flash, which no program fills.
    static constexpr uint16_t RETURN_FROM_MESSAGE = 0x7FFE;
    /// Light that comes up to so many cycles later concerns a call that looks for it.
    static constexpr uint64_t LOOK_CYCLES = 7;
    /// Duration of kilolib_infrared_receiving(), if nothing is received.
    static constexpr uint64_t SENSE_CALL_CYCLES = 11;

    /// Own time, and what it is in the world's.
    uint64_t cycle() const { return limit_ - static_cast<uint64_t>(left); }
    void set_cycle(uint64_t cycle) { left = static_cast<int64_t>(limit_ - cycle); }
    Cycles world_time() const { return clock_.world_time(cycle()); }
    uint64_t end_of_run() const;
    bool goes_on() const {
        return robot_.life == RobotRecord::Life::ALIVE &&
               robot_.question == RobotRecord::Question::NONE;
    }

    /// Data space, by address.
    uint8_t &at(uint16_t address) { return data[address]; }
    uint16_t word(uint16_t address) const {
        return static_cast<uint16_t>(data[address] | data[address + 1] << 8);
    }
    void set_word(uint16_t address, uint16_t value);
    uint8_t status() const;

    // Running. A turn of run() serves what is due, then executes up to what comes next; attend() is
    // such a turn from within the main region. What needs all registers (a message that is handed
    // to the program) is for run() alone.
    void set_limit();  ///< `left` counts to the next interrupt, or to the end of the run
    uint64_t place_wanted(uint64_t now);
    void execute();
    bool attend(unsigned what);  ///< as translated_chip_t.attend()
    bool attend_to(unsigned what);
    /// While passes repeat: interrupts that change nothing but the clock are left out, edges of
    /// light in any case, ticks if the pass is a known one. recall() finds whether it is.
    void rest();
    void take_edges_at_rest();
    bool take_ticks_at_rest();
    bool recall();
    /// While a known pass goes on: what is kept of it, and of asks for a message that get none.
    const KnownPass *find_known_pass(uint32_t &lasts) const;
    static TickRest rest_of(const KnownPass &known);
    void recall_request(const KnownPass &found, uint32_t lasts);
    uint32_t cycles_with_tick(uint32_t phase) const;
    Cycles rests_until() const;
    void execute_code();
    bool execute_one();
    bool note_pass();
    void disturb_passes();
    void doze();
    void fail();
    Debugging::Instruction instruction() const;
    /// Before each instruction, if a debugger holds it. Bits for `changed`.
    uint8_t instruction_begins();

    // Mistakes of its program, told once each (mistakes.cpp).
    void note(uint8_t mistake, const char *text);
    bool makes_mistake();
    void starts_again();
    void look_at_stack(uint16_t pointer);
    void divides_by_zero();

    // For the trail.
    Trail::Moment moment() const;
    void stores(uint16_t address, uint8_t value);
    /// For a debugger that notes what changes: code is about to begin, or has ended.
    void note_written();
    CodePath path_here() const;
    void note_outputs(uint8_t color, uint16_t duties);
    uint16_t duties() const { return static_cast<uint16_t>(robot_.left << 8 | robot_.right); }

    void store();
    /// At least so long no interrupt is let through, though a tick's waits; 0: none does.
    uint64_t held_back_until() const;

    // Interrupts. They come in the order of their vectors: the tick, a message, the serial line.
    // The tick's is left out, by arithmetic, if it would do no more than count.
    bool lets_interrupts() const { return flags[7] != 0; }
    void flag_matches();
    void watch_main_loop();
    bool serve_interrupt();
    uint64_t next_but_edges() const;
    uint64_t serial_asks_at() const;
    /// Whether the tick's interrupt does no more than count and, where that is due, ask the program
    /// for a message; whether it only counts.
    bool ticks_are_plain() const;
    bool can_count_tick() const;
    void count(uint32_t ticks);
    void count_tick();
    uint32_t ticks_now() const {
        uint32_t ticks;
        std::memcpy(&ticks, data + seam_.ticks, sizeof ticks);
        return ticks;
    }
    /// After the tick, whose vector is before it.
    bool message_is_due() const {
        return lets_interrupts() && image_.flagged == TranslatedImage::NO_TIME &&
               message_at_ <= cycle() && cycle() < until_;
    }
    void return_from_interrupt();
    void begin_interrupt(Interrupt which);
    void end_interrupt();
    void find_message();  ///< when the next one comes
    bool forget_beside(Cycles at);
    bool hears_light() const;
    void find_edge();                    ///< the next one
    void take_edge(uint16_t delay = 0);  ///< delay_of_start()
    bool frame_is_alone() const;         ///< the one that has the next edge
    uint64_t next_of_frame() const;
    /// Whether the runtime's reader is in a frame's leader.
    uint8_t &measures() { return data[seam_.message - offsetof(infrared_reader_t, message)]; }
    bool edge_matters();
    bool loses_edge(uint64_t now) const;
    uint16_t delay_of_start(uint64_t now) const;
    void note_flaw(uint64_t now);
    std::optional<int16_t> take_flaw(uint64_t begin);
    uint32_t cycles_of_byte() const;  ///< if a byte of a frame begins; or 0
    void take_byte();
    /// Takes edges up to a moment at which none waits for another's interrupt. An edge that waits
    /// until the next one of its frame has come is lost, by arithmetic as on the chip: where that
    /// may be so the pass is executed.
    bool take_burst_at_rest(uint64_t &now, uint64_t end);
    /// All up to the frame's end at once, if there is room for them: most of a frame's time nothing
    /// else happens, and one by one they would take as long as a pass of loop().
    bool take_frame_at_rest(uint64_t &now, uint64_t end);
    void serve_edge();
    void take_message();
    void end_message();

    // Calls of the engine: each reads its arguments where avr-gcc puts them, and returns.
    void call();
    void call(unsigned number);
    void come_back(uint16_t result, uint64_t cycles);
    void sense();
    void send();
    void convert();
    uint64_t cycles_of_triggered() const;
    void frame_began();
    void distance();

    // Questions to the channel.
    Cycles asked_at() const;
    bool is_asked_in_time() const;
    void wait_for_answer(unsigned number, RobotRecord::Question question);
    void take_answer();
    void put_on_air(const message_t &message);
    void end_sending(bool is_sent, uint64_t cycles);

    // Registers: the first two are the interpreter's.
    static uint8_t read_register(translated_chip_t *chip, uint16_t address);
    static void register_written(translated_chip_t *chip, uint16_t address);
    void register_written(uint16_t address);
    uint8_t pin_written(uint16_t address);
    void set_register(uint16_t address, uint8_t value);
    void timer_written(uint16_t address);
    void find_match();
    bool timer_ticks() const;
    void eeprom_written();
    /// When the last byte is written.
    uint64_t eeprom_free() const { return rare_ == nullptr ? 0 : rare_->eeprom_free; }
    void leave_out_polls();
    void print(uint8_t byte);
    void look_at_pins();

    TranslatedProgram &program_;
    TranslatedProgram::Learned &learned_;  ///< of its program, by its share
    RobotRecord &robot_;
    TranslatedImage &image_;
    Own<TranslatedState::Rare> &rare_;
    TranslatedState &state_;
    Debugging *const debugging_;   ///< null unless a debugger holds it
    WrittenBytes *const written_;  ///< null unless one notes what it writes
    const translation_t &code_;
    const translated_seam_t &seam_;
    const BoardClock clock_;
    uint64_t limit_ = 0;  ///< `left` counts down to it
    uint64_t until_ = 0;  ///< end of the run
    /// When the next message has to be taken.
    uint64_t message_at_ = TranslatedImage::NO_TIME;
    /// The next edge of light, and the cycles that its interrupt takes.
    uint64_t edge_at_ = TranslatedImage::NO_TIME;
    uint32_t edge_cycles_ = 0;
    SeenFrame *edge_light_ = nullptr;  ///< the frame that it is of
    bool edge_is_late_ = false;        ///< it came while the robot sent
    bool ends_run_ = false;            ///< limit_ is the end of the run
    bool limit_changed_ = false;       ///< the next interrupt comes at another time than it was
    bool is_early_ = false;            ///< what a call asks for is not known before the next run
};

}  // namespace kilotwin

#endif
