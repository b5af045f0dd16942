/// One module of a Kilogrid from its very .hex: the ATmega328P and what is wired to it on the published board,
/// revision A (hardware.md 3.1, kilogrid_modules/runtime/avr/board.h): CAN controller, LED driver, and one infrared
/// transmitter and one receiver behind multiplexers to the four cells.
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
#include "base/chance.h"
#include "guest/module.h"
#include "infrared/light_edges.h"

namespace kilotwin {

class ModuleBoard : private Microcontroller::Board {
  public:
    /// The light of a cell's transmitter goes on or off.
    struct Light {
        Cycles at;
        uint8_t cell;
        bool on;
    };
    struct Serial {
        Cycles at;
        uint8_t byte;
    };

    /// The EEPROM of the module at column `x`, row `y`, as it comes.
    static EepromImage eeprom_of(uint8_t x, uint8_t y);

    /// Module `index` is switched on at `power_up`; `tick` by its own oscillator. `chance` must live on.
    ModuleBoard(const FlashImage &flash, uint32_t index, const EepromImage &eeprom, Cycles tick,
                Cycles power_up, const Chance &chance);

    /// Lives through everything before `until`, plus what is left of the instruction begun.
    void run(Cycles until);
    Cycles now() const { return clock_.world_time(chip_.cycle()); }

    /// Lets light fall on the receiver of a cell; `pulse.begin` is not earlier than now().
    void shine(uint8_t cell, const LightPulse &pulse);

    /// A frame of another node has ended on the bus, at `at`, not earlier than now().
    void receive_can(Cycles at, const CanFrame &frame);
    /// The one that it handed out last has, or it was lost.
    void frame_sent(Cycles at);
    void frame_lost();
    /// What the bus counts of its errors.
    void set_can_errors(uint32_t transmit, uint32_t receive, bool bus_off);

    /// The cell that the receiver listens to.
    uint8_t listening_cell() const { return cell_; }
    CellLight light(uint8_t cell) const;
    EepromImage eeprom() const { return chip_.eeprom(); }
    uint8_t read(uint16_t address) const { return chip_.read(address); }  ///< SRAM or a register
    const std::string &failure() const { return chip_.failure(); }
    /// Nominal ticks of 262,144 of its cycles since power-up.
    uint32_t tick() const { return static_cast<uint32_t>(chip_.cycle() / TICK_CYCLES); }
    uint32_t frames_missed() const { return controller_.missed(); }

    // What it did since the caller cleared them, in order of time.
    std::vector<Light> lights;
    std::vector<Serial> serial;
    std::vector<CanOutput> can_frames;  ///< one at a time: the next when this one is sent

  private:
    /// What comes over the bus, to be told the chip when it is due.
    struct Arrival {
        uint64_t cycle;
        bool is_own;  ///< that one is sent
        CanFrame frame;
    };

    void register_written(uint16_t address) override;
    void flag_set(uint8_t vector) override { converter_.flag_set(vector); }
    void alarm(Microcontroller::Alarm alarm) override;
    void serial_byte(uint8_t byte) override { serial.push_back({now(), byte}); }
    uint8_t spi_exchange(uint8_t byte) override;
    void quiet_sleep() override { converter_.quiet_sleep(); }
    void was_reset() override;

    int16_t sample(uint8_t channel);
    void look_at_ports();
    void pass_edges();
    void show_light();
    void arrive(const Arrival &arrival);
    void take_arrivals();
    void look_at_controller();

    uint32_t index_;
    BoardClock clock_;
    const Chance &chance_;
    Mcp2515 controller_;
    Pca9635 leds_;
    Microcontroller chip_;
    Converter converter_;
    TwiMaster two_wire_;
    std::array<LightEdges, CELLS_PER_MODULE> receivers_;
    std::queue<Arrival> arrivals_;
    uint64_t conversions_ = 0;
    uint8_t cell_ = 0;        ///< that the receiver listens to
    bool high_gain_ = false;  ///< by the amplifier that it has chosen
    bool selected_ = false;   ///< the controller
    bool ir_on_ = false;
    uint8_t ir_cell_ = 0;
};

}  // namespace kilotwin

#endif
