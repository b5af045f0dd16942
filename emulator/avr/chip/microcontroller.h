/// An ATmega328P at 8 MHz, run by simavr instruction by instruction.
///
/// It adds what simavr 1.6 lacks and a Kilobot's firmware needs: interrupt
/// vectors moved to the boot section, the program counter's wrap at 16 K words, timers that stand still in
/// power-down, and an account of why a program cannot go on. Time is the chip's own: cycles since power-up.
#ifndef KILOTWIN_AVR_CHIP_MICROCONTROLLER_H
#define KILOTWIN_AVR_CHIP_MICROCONTROLLER_H

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "avr/chip/flash_image.h"
#include "avr/chip/idle_loop.h"
#include "guest/eeprom.h"

struct avr_t;

namespace kilotwin {

class Microcontroller {
  public:
    /// The chip's alarm clocks, for what is around it.
    enum Alarm : uint8_t { LIGHT_EDGE, CONVERSION, TWO_WIRE, FRAME, ALARMS };
    static constexpr uint64_t NO_ALARM = UINT64_MAX;

    /// What is wired to the chip.
    class Board {
      public:
        virtual ~Board() = default;
        virtual void register_written(
            uint16_t address) = 0;  ///< one of those watched; the new value is in place
        virtual void flag_set(uint8_t vector) = 0;  ///< of a watched interrupt
        virtual void alarm(Alarm alarm) = 0;
        virtual void serial_byte(uint8_t byte) = 0;  ///< by the UART
        virtual void was_reset() = 0;                ///< by the watchdog: registers are 0 again
        /// A byte goes out by the SPI; the one that comes back for it.
        virtual uint8_t spi_exchange(uint8_t) { return 0xFF; }
        virtual void quiet_sleep() = 0;  ///< begins, in the mode that converts meanwhile
    };

    /// Looks on, instruction by instruction.
    class Follower {
      public:
        virtual ~Follower() = default;
        /// After an instruction at `from`: the program counter, which an interrupt may have moved, and the stack
        /// pointer.
        virtual void executed(uint32_t from, uint32_t pc, uint16_t sp) = 0;
    };

    Microcontroller(Board &board, const FlashImage &flash, const EepromImage &eeprom);
    ~Microcontroller();
    Microcontroller(const Microcontroller &) = delete;
    Microcontroller &operator=(const Microcontroller &) = delete;

    /// Runs up to the first instruction at or after `until`, or until the program fails. While it only waits,
    /// cycle() may stay a little before `until`: nothing happens up to there.
    void run(uint64_t until);
    uint64_t cycle() const;

    /// For tests: executes every instruction, also where the program only waits.
    void skip_nothing() { idle_.reset(); }

    /// From now on `follower` is told of every instruction; none is passed over. It must live on.
    void follow(Follower &follower);

    /// Why the program cannot go on, with the program counter; empty: it can.
    const std::string &failure() const { return failure_; }

    uint8_t read(uint16_t address) const;         ///< of data space, without side effects
    void write(uint16_t address, uint8_t value);  ///< likewise

    /// Tells the board of writes to a register: of all, or of those that change it.
    enum class Watch : uint8_t { WRITES, CHANGES };
    void watch_register(uint16_t address, Watch watch);
    void watch_interrupt(uint8_t vector);

    /// From now on simavr's own model of the register is out of the way: it is plain memory.
    void take_over(uint16_t address);

    void raise_interrupt(uint8_t vector);
    void clear_interrupt(uint8_t vector);

    /// Calls the board's alarm() when the cycle comes; once, and instead of an earlier setting.
    void set_alarm(Alarm alarm, uint64_t at);

    void set_comparator(bool light);                  ///< level of the analog comparator's input
    void set_pin(char port, uint8_t pin, bool high);  ///< from outside

    EepromImage eeprom() const;
    uint8_t flash(uint16_t address) const;

    /// Waits for gdb on 127.0.0.1 before it executes anything more. Throws EngineError if the port is taken.
    void serve_debugger(uint16_t port);

  private:
    struct Hooks;
    struct Clock {
        Microcontroller *chip;
        Alarm which;
        uint64_t at = NO_ALARM;
    };

    /// A register whose writes the board is told of, and what simavr does with them.
    struct Watched {
        Microcontroller *chip;
        Watch watch;
        void (*write)(avr_t *, uint16_t address, uint8_t value, void *parameter);
        void *parameter;
    };

    /// A register that changes by itself, and how simavr reads it.
    struct Read {
        Microcontroller *chip;
        uint8_t (*read)(avr_t *, uint16_t address, void *parameter);
        void *parameter;
    };

    void recover(int state);
    void watch_reads();
    void sleep(uint64_t until);
    void put_off_timers(uint64_t cycles);
    bool wakes_from_power_down(const void *timer_owner) const;
    void arm(Clock &clock);
    void note(const char *format, const char *text);
    void set_serial_rate();
    void watch_enables(uint16_t address);
    void review_interrupts(uint16_t address);

    Board &board_;
    avr_t *avr_;
    std::unique_ptr<IdleLoop> idle_;
    std::deque<Read> reads_;
    std::array<Clock, ALARMS> clocks_;
    std::deque<Watched> watched_;
    std::string failure_;
    uint32_t crashed_at_ = 0;  ///< program counter where simavr gave up
    bool crashed_ = false;
    bool was_reset_ = false;
    bool reviewing_ = false;
    bool asleep_ = false;  ///< and its clocks stand still
    bool light_ = false;   ///< at the comparator
    uint32_t boot_section_;
    uint64_t dozed_ = 0;  ///< how far simavr's own way to sleep went ahead
    void (*core_reset_)(avr_t *) = nullptr;
    Follower *follower_ = nullptr;
    void (*core_run_)(avr_t *) = nullptr;
};

}  // namespace kilotwin

#endif
