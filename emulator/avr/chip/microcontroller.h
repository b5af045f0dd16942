/// An ATmega328P at 8 MHz, executed by simavr instruction by instruction.
///
/// Adds what simavr 1.6 lacks and a Kilobot's firmware needs: interrupt vectors moved to the boot
/// section, self-programming that takes its time, the program counter's wrap at 16 K words, timers
/// that stand still in power-down, pending interrupts that are enabled later, the UART's rate, and
/// the reason why a program cannot go on.
///
/// Time is the chip's own: cycles of 125 ns since power-up, by its own oscillator. A chip is driven
/// by its board and belongs to one thread. Cost: that of the instructions executed; time in which
/// the program idles is skipped (IdleLoop).
#ifndef KILOTWIN_AVR_CHIP_MICROCONTROLLER_H
#define KILOTWIN_AVR_CHIP_MICROCONTROLLER_H

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "avr/chip/flash_image.h"
#include "avr/chip/idle_loop.h"
#include "avr/chip/self_programming.h"
#include "avr/chip/translated_core.h"
#include "avr/chip/watchdog_reset.h"
#include "base/events.h"
#include "robots/eeprom.h"

struct avr_gdb_t;
struct avr_t;

namespace kilotwin {

class Microcontroller {
  public:
    /// Alarm clocks that a board may set, by purpose: one alarm each.
    enum Alarm : uint8_t { LIGHT_EDGE, CONVERSION, TWO_WIRE, FRAME, ALARMS };
    static constexpr uint64_t NO_ALARM = UINT64_MAX;

    /// The circuit around the chip. The chip calls it while it runs, at the cycle of the event; a
    /// board may read and write registers, set alarms and pins from within these calls.
    class Board {
      public:
        virtual ~Board() = default;
        /// The program wrote a watched register; the new value is in place.
        virtual void register_written(uint16_t address) = 0;
        /// The flag of a watched interrupt went up.
        virtual void flag_set(uint8_t vector) = 0;
        /// An alarm is due. It is not set any more.
        virtual void alarm(Alarm alarm) = 0;
        /// The UART has sent a byte.
        virtual void serial_byte(uint8_t byte) = 0;
        /// The watchdog has reset the chip: registers are 0 again, alarms stay.
        virtual void was_reset(const WatchdogReset &reset) = 0;
        /// The SPI sends a byte; returns the byte that is shifted in for it.
        virtual uint8_t spi_exchange(uint8_t) { return 0xFF; }
        /// Noise-reduction sleep begins, which starts a conversion.
        virtual void quiet_sleep() = 0;
    };

    /// Observer of every instruction.
    class Follower {
      public:
        virtual ~Follower() = default;
        /// Called after the instruction at byte address `from`, with the program counter (which an
        /// interrupt may have moved) and the stack pointer.
        virtual void executed(uint32_t from, uint32_t pc, uint16_t sp) = 0;
    };

    /// Powers the chip up at cycle 0 with `flash` programmed and `eeprom`, which the flash image's
    /// own EEPROM bytes override. `board` must live on; the images are copied. Code runs translated
    /// if the flash image brings its translation.
    Microcontroller(Board &board, const FlashImage &flash, const EepromImage &eeprom);
    ~Microcontroller();
    Microcontroller(const Microcontroller &) = delete;
    Microcontroller &operator=(const Microcontroller &) = delete;

    /// Runs up to the first instruction at or after `until`, or until the program fails. While the
    /// program idles, cycle() may stay a little before `until`: nothing observable happens up to
    /// there.
    void run(uint64_t until);
    uint64_t cycle() const;
    /// Up to which cycle run() would change nothing observable, if the board does nothing
    /// meanwhile; NO_ALARM: for ever, 0: not known.
    uint64_t rests_until() const;

    /// Executes every instruction from now on, also where the program only waits: the plain twin
    /// that tests compare with.
    void skip_nothing() { idle_.reset(); }

    /// Programs the fuse BOOTRST: the chip starts at its boot section, now and after every reset.
    /// To be called before it is run. A Kilobot's is not programmed.
    void start_at_boot_section();

    /// Erases and writes of flash pages that the program has done.
    uint32_t flash_operations() const { return programming_->operations(); }
    /// The whole flash as it is now; see also flash().
    const std::array<uint8_t, FlashImage::BYTES> &flash_content() const {
        return programming_->content();
    }

    /// Calls `follower` after every instruction from now on; implies skip_nothing(), and code is
    /// interpreted. It must live on.
    void follow(Follower &follower);

    /// Why the program cannot go on, with the program counter; empty: it can. After a failure run()
    /// does nothing.
    const std::string &failure() const { return failure_; }
    /// It has no power any more: as after a failure.
    void switch_off() { failure_ = "it is without power"; }
    /// Where that came about; empty without a failure.
    const CodePath &failure_code() const { return failure_code_; }

    // Data space (registers, SRAM) and flash, by address, without the side effects of an access by
    // the program.
    uint8_t read(uint16_t address) const;
    void write(uint16_t address, uint8_t value);
    uint8_t flash(uint16_t address) const;

    bool carry() const;  ///< the flag

    /// Which writes to a register the board is called for: all, or those that change it.
    enum class Watch : uint8_t { WRITES, CHANGES };
    /// Calls the board's register_written() for a register; once for each register.
    void watch_register(uint16_t address, Watch watch);
    /// Calls the board's flag_set() for an interrupt.
    void watch_interrupt(uint8_t vector);

    /// Removes simavr's own model of a register: it is plain memory, which the board gives a
    /// meaning. To be called before watch_register().
    void take_over(uint16_t address);

    // An interrupt's flag, as its peripheral sets and clears it.
    void raise_interrupt(uint8_t vector);
    void clear_interrupt(uint8_t vector);

    /// Calls the board's alarm() once, at cycle `at` or, if that has passed, with the next
    /// instruction; replaces an earlier setting. NO_ALARM: never.
    void set_alarm(Alarm alarm, uint64_t at);

    /// Level of the analog comparator's input: light on the receiver.
    void set_comparator(bool light);
    /// Drives an input pin: port 'B' to 'D', pin 0 to 7.
    void set_pin(char port, uint8_t pin, bool high);

    EepromImage eeprom() const;

    /// Opens 127.0.0.1:`port` for gdb. Throws EngineError if the port is taken.
    void listen_for_debugger(uint16_t port);
    /// Executes nothing more until gdb connects to that port, and continues.
    void serve_debugger();

  private:
    struct Hooks;
    struct Clock {
        Microcontroller *chip;
        Alarm which;
        uint64_t at = NO_ALARM;
    };

    /// A register whose writes are intercepted, and simavr's own handler of them.
    struct Watched {
        Microcontroller *chip;
        Watch watch;
        void (*write)(avr_t *, uint16_t address, uint8_t value, void *parameter);
        void *parameter;
    };

    /// A register that changes by itself, and simavr's own handler of reads.
    struct Read {
        Microcontroller *chip;
        uint8_t (*read)(avr_t *, uint16_t address, void *parameter);
        void *parameter;
    };

    void recover(int state);
    void watch_reads();
    void sleep(uint64_t until);
    void postpone_timers(uint64_t cycles);
    bool wakes_from_power_down(const void *timer_owner) const;
    void arm(Clock &clock);
    void note(const char *format, const char *text);
    void fail(std::string why);
    void set_serial_rate();
    void set_spi_time();
    void watch_enables(uint16_t address);
    void review_interrupts(uint16_t address);
    void run_translated();
    bool goes_on(void (*own_run)(avr_t *)) const;

    Board &board_;
    avr_t *avr_;
    avr_gdb_t *debugger_ = nullptr;  ///< listens; simavr's once it is served
    std::unique_ptr<IdleLoop> idle_;
    std::unique_ptr<SelfProgramming> programming_;
    std::unique_ptr<TranslatedCore> translated_;  ///< null: code is interpreted
    uint32_t flash_seen_ = 0;                     ///< changes of the flash that translated_ knows
    std::deque<Read> reads_;
    std::array<Clock, ALARMS> clocks_;
    std::deque<Watched> watched_;
    std::string failure_;
    CodePath failure_code_;
    uint32_t crashed_at_ = 0;  ///< program counter where simavr gave up
    bool crashed_ = false;
    bool was_reset_ = false;
    WatchdogReset reset_ = {};  ///< the last one, or the next, should it come now
    bool reviewing_ = false;    ///< flags go up that were up before
    bool asleep_ = false;       ///< in a sleep mode in which its clocks stand still
    bool light_ = false;        ///< level at the comparator
    uint32_t boot_section_;
    uint64_t dozed_ = 0;  ///< cycles that simavr went ahead when the chip fell asleep
    Follower *follower_ = nullptr;
    // simavr's own functions, behind the hooks that replace them.
    void (*core_reset_)(avr_t *) = nullptr;
    void (*core_run_)(avr_t *) = nullptr;
};

}  // namespace kilotwin

#endif
