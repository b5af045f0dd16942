/// One module of a Kilogrid that runs its .hex: the ATmega328P and the circuit of the published
/// board, revision A (hardware.md 3.1, kilogrid_modules/runtime/avr/board.h): CAN controller, LED
/// driver, and one infrared transmitter and one receiver, both multiplexed to the four cells.
///
/// All times are world time. A board belongs to one thread; its owner carries light and
/// frames between it and the rest of the grid.
#ifndef KILOTWIN_AVR_BOARDS_MODULE_BOARD_H
#define KILOTWIN_AVR_BOARDS_MODULE_BOARD_H

#include <array>
#include <queue>
#include <string>
#include <vector>

#include "avr/boards/mcp2515.h"
#include "avr/boards/pca9635.h"
#include "avr/boards/twi_master.h"
#include "avr/chip/converter.h"
#include "avr/chip/flash_image.h"
#include "avr/chip/microcontroller.h"
#include "avr/chip/watchdog_reset.h"
#include "base/board_clock.h"
#include "base/chance.h"
#include "infrared/light_edges.h"
#include "modules/module.h"

namespace kilotwin {

class ModuleBoard : private Microcontroller::Board {
  public:
    /// The infrared LED of a cell going on or off.
    struct Light {
        Cycles at;
        uint8_t cell;
        bool on;
    };
    /// A byte that the UART sends.
    struct Serial {
        Cycles at;
        uint8_t byte;
    };

    /// EEPROM of the module at column `x`, row `y`: uncalibrated but for its address.
    static EepromImage eeprom_of(uint8_t x, uint8_t y);

    /// Switches module `index` on at `power_up`. `tick`: cycles of world time in a nominal tick of
    /// its own oscillator. `chance` must live on; the images are copied.
    ModuleBoard(const FlashImage &flash, uint32_t index, const EepromImage &eeprom, Cycles tick,
                Cycles power_up, const Chance &chance);

    /// Runs up to `until`, plus the rest of the instruction begun. Cheap while the program idles.
    void run(Cycles until);
    /// Up to when run() would do nothing that shows, if nothing comes from outside meanwhile;
    /// NEVER: for ever. 0, or the past, if that is not known.
    Cycles rests_until() const {
        const uint64_t cycle = chip_.rests_until();
        return cycle == Microcontroller::NO_ALARM ? NEVER : clock_.world_time(cycle);
    }
    /// The time that it has been run up to.
    Cycles now() const { return clock_.world_time(chip_.cycle()); }

    /// Lets light fall on the receiver of a cell; `pulse.begin` is not earlier than now(). The
    /// receiver gets it while the multiplexer selects that cell.
    void shine(uint8_t cell, const LightPulse &pulse);

    /// A frame of another node ends on the bus at `at`, not earlier than now().
    void receive_can(Cycles at, const CanFrame &frame);
    /// The frame that it handed out last ends on the bus at `at`, or was lost and may be sent
    /// again.
    void frame_sent(Cycles at);
    /// The bus gave that frame up: an error or a lost node. The controller hands it out again.
    void frame_lost();
    /// The bus's error counters of this node.
    void set_can_errors(uint32_t transmit, uint32_t receive, bool bus_off);

    /// The cell that the receiver's multiplexer selects.
    uint8_t listening_cell() const { return cell_; }
    /// Light of a cell's LEDs, as the LED driver dims them.
    CellLight light(uint8_t cell) const;
    /// The EEPROM as the program has left it by now.
    EepromImage eeprom() const { return chip_.eeprom(); }
    uint8_t read(uint16_t address) const { return chip_.read(address); }  ///< SRAM or a register
    const std::array<uint8_t, FlashImage::BYTES> &flash_content() const {
        return chip_.flash_content();
    }
    uint32_t flash_operations() const { return chip_.flash_operations(); }  ///< since power-up
    /// Why the program cannot go on; empty while it can.
    const std::string &failure() const { return chip_.failure(); }
    /// Where that came about; empty without a failure.
    const CodePath &failure_code() const { return chip_.failure_code(); }
    /// Nominal ticks of 262,144 of its cycles since power-up.
    uint32_t tick() const { return static_cast<uint32_t>(chip_.cycle() / TICK_CYCLES); }
    /// Frames that found the controller's receive buffers full.
    uint32_t frames_missed() const { return controller_.missed(); }

    // Outputs in order of time, appended by run(); the caller takes and clears them.
    std::vector<Light> lights;
    std::vector<Serial> serial;
    std::vector<ReportedReset> resets;  ///< by the watchdog
    std::vector<CanOutput> can_frames;  ///< one at a time: the next when this one has ended

  private:
    /// An end of a frame on the bus, for the controller once the chip has come to that cycle.
    struct Arrival {
        uint64_t cycle;
        bool is_own;  ///< the frame that the controller handed out
        CanFrame frame;
    };

    void register_written(uint16_t address) override;
    void flag_set(uint8_t vector) override { converter_.flag_set(vector); }
    void alarm(Microcontroller::Alarm alarm) override;
    void serial_byte(uint8_t byte) override { serial.push_back({now(), byte}); }
    uint8_t spi_exchange(uint8_t byte) override;
    void quiet_sleep() override { converter_.quiet_sleep(); }
    void was_reset(const WatchdogReset &reset) override;

    int16_t sample(uint8_t channel);  ///< reading of a converter's channel, 0..1023
    void update_ports();
    void pass_edges();
    void update_comparator();
    void arrive(const Arrival &arrival);
    void take_arrivals();
    void update_controller();

    uint32_t index_;
    BoardClock clock_;
    const Chance &chance_;
    Mcp2515 controller_;
    Pca9635 leds_;
    Microcontroller chip_;
    Converter converter_;
    TwiMaster two_wire_;
    std::array<LightEdges, CELLS_PER_MODULE> receivers_;  ///< one per cell
    std::queue<Arrival> arrivals_;                        ///< in order of time
    uint64_t conversions_ = 0;                            ///< draws of noise so far
    uint8_t cell_ = 0;        ///< selected by the receiver's multiplexer
    bool high_gain_ = false;  ///< the amplifier selected by it
    bool selected_ = false;   ///< the controller, on the SPI
    bool ir_on_ = false;      ///< the transmitter's LED
    uint8_t ir_cell_ = 0;     ///< of the cell that its multiplexer selected when it went on
};

}  // namespace kilotwin

#endif
