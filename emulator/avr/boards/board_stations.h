/// Robots and modules on boards as stations of the Kilobots' channel.
///
/// A chip sends pulse by pulse: the first puts a frame on air, what it says is known with the last.
/// It receives pulse by pulse, too, so chance decides at a frame's begin whether one pulse is lost.
/// Collisions and deafness are the chip's own affair; here they are only counted.
/// Carrier sense is the program's: no frame of a board waits for the channel's answer.
#ifndef KILOTWIN_AVR_BOARDS_BOARD_STATIONS_H
#define KILOTWIN_AVR_BOARDS_BOARD_STATIONS_H

#include <vector>

#include "avr/boards/boards.h"
#include "grid/cell_stations.h"
#include "infrared/kilobot_channel.h"
#include "infrared/station.h"

namespace kilotwin {

/// Robots on boards. Executes the modules on boards, too: all are in lock-step. Comes before the
/// cells in the channel: what boards send reaches the grid a quantum later at the earliest.
class BoardRobots final : public Stations {
  public:
    /// Takes over the robots with a board from the channel. Everything referred to must live on.
    BoardRobots(Boards &boards, KilobotChannel &channel, const Chance &chance);

    void boot(Cycles until) override;
    Cycles next_turn() const override;

    /// Executes boards up to `turn`, or to the next flash, which goes to the channel.
    bool run(Cycles turn, Cycles next) override;

    double range_m(uint32_t robot) const override { return channel_.robot_range_m(robot); }
    void shine(Frame &frame) override { channel_.shine_around_robot(frame); }
    void gave_up(const Frame &frame) override;
    void sent(const Frame &frame) override;
    void light_begins(const Frame &frame, Reached &reached) override;

    /// Counts: the board has seen the frame's pulses.
    void received(const Frame &frame, const Reached &reached) override;

    void forget_reached(uint32_t sender) override { boards_.forget_reached(sender); }
    void first_pulse(uint32_t sender, Cycles at) override { boards_.first_pulse(sender, at); }
    void other_pulses(uint32_t sender, Cycles at, const message_t &message) override {
        boards_.other_pulses(sender, at, message);
    }

  private:
    /// Puts a frame on air, hands a pulse on, or ends a frame, as the flash says.
    void take_flash(const Boards::Flash &flash);

    Boards &boards_;
    KilobotChannel &channel_;
    const Chance &chance_;
};

/// Cells of modules on boards. Executes the grid's buses; the modules are BoardRobots' to execute.
class BoardCells final : public KilobotCells {
  public:
    /// The first cell is station `first`. Everything referred to must live on.
    BoardCells(Grid &grid, Boards &boards, KilobotChannel &channel, const Bodies &bodies,
               const Chance &chance, uint32_t first);

    /// Executes the buses. Never stops: a module's infrared comes as flashes.
    bool run(Cycles turn, Cycles next) override;
    /// A board's next frame cannot be foreseen.
    bool begins_near(uint32_t robot, Cycles /*until*/) const override {
        return !grid_.cells_near(robot).empty();
    }
    void gave_up(const Frame & /*frame*/) override { grid_.counts.put_off++; }
    void sent(const Frame & /*frame*/) override { grid_.counts.sent++; }
    void received(const Frame &frame, const Reached &reached) override;

  private:
    /// Light falls on the receiver of a cell, whichever cell its module listens to.
    void shine_on_cell(Frame &frame, uint32_t cell, double distance_m) override;

    Boards &boards_;
    const Chance &chance_;
    std::vector<uint64_t> draws_;  ///< by module
};

}  // namespace kilotwin

#endif
