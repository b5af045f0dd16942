/// The cells of a grid as stations: on the Kilobots' channel, and beside the ideal one.
///
/// Cells are numbered behind the robots, four to a module. A module sends from one cell at a time
/// and listens to one cell at a time (hardware.md 3.4); what it shares among its four cells is kept
/// here.
///
/// The channel calls these as any kind of station (infrared/station.h). They turn the numbers of
/// cells and modules into stations and back, and add what light does between robots and cells: what
/// it reaches, and what a module with one receiver makes of it. Cost per frame: O(cells near the
/// robot), or O(robots near the cell).
#ifndef KILOTWIN_GRID_CELL_STATIONS_H
#define KILOTWIN_GRID_CELL_STATIONS_H

#include <cstdint>
#include <vector>

#include "grid/grid.h"
#include "infrared/ideal_channel.h"
#include "infrared/kilobot_channel.h"
#include "infrared/station.h"
#include "modules/guest_modules.h"
#include "robots/infrared_gains.h"

namespace kilotwin {

/// Common to all cells: the grid is executed in the order of time, whatever its modules
/// are, and may begin a frame at any time.
class CellStations : public Stations {
  public:
    /// `grid` and `bodies` must live on. Nothing else executes the grid.
    CellStations(Grid &grid, const Bodies &bodies) : grid_(grid), bodies_(bodies) {}

    /// Modules that send meanwhile are answered that their frames went out: no robot receives yet.
    void boot(Cycles until) override;
    void host_silent_until(Cycles until) override { grid_.no_host_before(until); }

    /// Finds which robots are near which cell, each 16 ticks. Time O(robots + cells), then.
    void begin_step(Cycles now) override;

    /// A frame of the host may make a module send at any time.
    bool has_lookahead() const override { return false; }
    Cycles next_turn() const override { return grid_.next(); }
    double range_m(uint32_t /*station*/) const override { return grid_.infrared().cell_range_m; }

  protected:
    /// Centre to centre.
    double distance_m(uint32_t robot, uint32_t cell) const {
        return (bodies_.position(robot) - grid_.layout().centre(cell)).norm();
    }

    Grid &grid_;
    const Bodies &bodies_;

  private:
    Cycles begin_ = 0;  ///< when stepping begins: robots are looked for from then on
};

/// Cells beside the ideal channel: robots within a cell's range receive its frames, and the cell
/// below a robot receives the robot's. No carrier sense, no collisions.
class IdealCells final : public CellStations {
  public:
    IdealCells(Grid &grid, IdealChannel &channel)
        : CellStations(grid, channel.bodies()),
          channel_(channel) {}

    /// Executes the grid up to the next frame of a cell, and delivers that.
    bool run(Cycles turn, Cycles next) override;

    /// Delivers a robot's frame to the cell below it; one with a wrong CRC, too, as such.
    void shine_from_robot(Frame &frame, const Eigen::Vector2d &from) override;

  private:
    IdealChannel &channel_;
};

/// Cells on the Kilobots' channel, and what of that does not depend on what executes their modules.
class KilobotCells : public CellStations {
  public:
    /// The first cell is station `first`.
    KilobotCells(Grid &grid, KilobotChannel &channel, const Bodies &bodies, uint32_t first)
        : CellStations(grid, bodies),
          channel_(channel),
          first_(first) {}

    void shine(Frame &frame) override;
    void shine_from_robot(Frame &frame, const Eigen::Vector2d &from) override;

  protected:
    /// The light of a robot's frame begins at a cell in range: decides its fate there.
    virtual void shine_on_cell(Frame &frame, uint32_t cell, double distance_m) = 0;

    /// Counts a frame that is not received; true if it is.
    bool count(const Reached &reached);

    // Numbers of stations, cells and modules.
    bool is_cell(uint32_t station) const { return station >= first_; }
    uint32_t station_of(uint32_t cell) const { return first_ + cell; }
    uint32_t cell_of(uint32_t station) const { return station - first_; }
    uint32_t module_of(uint32_t station) const { return GridLayout::module_of(cell_of(station)); }

    KilobotChannel &channel_;
    InfraredGains gains_;  ///< of all modules: they measure alike

  private:
    uint32_t first_;
};

/// Cells of modules as guests.
class GuestCells final : public KilobotCells {
  public:
    /// The cells of `modules`, which `grid` executes. Everything referred to must live on.
    GuestCells(Grid &grid, GuestModules &modules, KilobotChannel &channel, const Bodies &bodies,
               const Chance &chance, uint32_t first)
        : KilobotCells(grid, channel, bodies, first),
          modules_(modules),
          chance_(chance),
          transceivers_(grid.layout().modules()) {}

    /// Executes the grid up to where a module is about to send, and begins that frame, or answers
    /// the module that it cannot.
    bool run(Cycles turn, Cycles next) override;
    bool begins_near(uint32_t robot, Cycles until) const override;
    void sensed(const Frame &frame, bool busy) override;
    void gave_up(const Frame &frame) override;

    /// Frames of robots, wrong CRC or not, reach the module unless chance loses them.
    void received(const Frame &frame, const Reached &reached) override;

    /// Modules whose receiver the frame reaches stay with that cell, and do not send meanwhile.
    void hold_receivers(const Frame &frame, Cycles begin, Cycles end) override;

  private:
    /// Occupation of a module's one transmitter and one receiver.
    struct Transceiver {
        Cycles sending_until = 0;    ///< deaf before
        Cycles receiving_until = 0;  ///< does not send before
        uint64_t draws = 0;          ///< so many numbers were drawn for what it receives
    };

    /// A module sends what it was about to, or finds that it cannot.
    void begin_frame(const Grid::Question &question);
    bool is_channel_free(uint32_t cell, Cycles at) const;
    void shine_on_cell(Frame &frame, uint32_t cell, double distance_m) override;

    GuestModules &modules_;
    const Chance &chance_;
    std::vector<Transceiver> transceivers_;  ///< by module
};

}  // namespace kilotwin

#endif
