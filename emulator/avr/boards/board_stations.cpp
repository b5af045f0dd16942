#include "avr/boards/board_stations.h"

#include <algorithm>

namespace kilotwin {

BoardRobots::BoardRobots(Boards &boards, KilobotChannel &channel, const Chance &chance)
    : boards_(boards),
      channel_(channel),
      chance_(chance) {
    for (uint32_t robot : boards.robots()) channel.assign(*this, robot, 1);
    if (channel.carrier_sense().held_busy()) boards.hold_busy();
}

void BoardRobots::boot(Cycles until) {
    boards_.run(until, [](uint32_t) { return false; });
}

// Boards and modules see one another's light: neither may get ahead.
Cycles BoardRobots::next_turn() const {
    return boards_.has_modules() ? boards_.now() + Boards::QUANTUM : NEVER;
}

bool BoardRobots::run(Cycles turn, Cycles /*next*/) {
    const FramesInFlight &in_flight = channel_.in_flight();
    const auto flash = boards_.run(turn, [&](uint32_t robot) {
        return in_flight.is_on_air(robot) || !in_flight.is_dark(robot);
    });
    if (flash) take_flash(*flash);
    return flash.has_value();
}

/// Light of a board arrives.
void BoardRobots::take_flash(const Boards::Flash &flash) {
    using Found = PulseReader::Found;
    FramesInFlight &in_flight = channel_.in_flight();
    const uint32_t sender = flash.station;
    if (flash.begins && flash.found == Found::BEGIN) {
        // The last one was torn off, as by a reset: it counts as no attempt.
        if (in_flight.is_on_air(sender)) in_flight.take_off_air(in_flight.of(sender));
        channel_.begin_light(sender, flash.at, {});
    }
    // Whether more pulses follow is not known: receivers stay as long as one may be missing.
    if (flash.begins && in_flight.is_on_air(sender))
        channel_.hold_receivers(in_flight.of(sender), flash.at, flash.at + PulseReader::SILENCE);
    if (!flash.given_up) boards_.pulse(sender, flash.at, flash.end, flash.begins);
    if ((flash.given_up || flash.found == Found::NONSENSE) && in_flight.is_on_air(sender))
        channel_.give_up(sender);
    if (flash.found == Found::MESSAGE && in_flight.is_on_air(sender)) {
        in_flight.message(sender).say(flash.message);
        in_flight.of(sender).granted = true;
        channel_.end_frame(sender);
    }
}

void BoardRobots::gave_up(const Frame & /*frame*/) { channel_.tally().attempts_failed++; }

void BoardRobots::sent(const Frame &frame) {
    channel_.tally().sent++;
    channel_.tally().wrong_crc += !frame.message->crc_is_right();
    channel_.in_flight().station(frame.sender).counts.sent++;
}

void BoardRobots::light_begins(const Frame &frame, Reached &reached) {
    const bool from_above = frame.above > 0;
    const uint64_t draw =
        from_above ? frame.above : channel_.in_flight().station(reached.station).draws++;
    const bool lost = channel_.receiver().is_lost(frame, reached, draw);
    if (lost && reached.fate == Fate::CLEAR) reached.fate = Fate::LOST;
    boards_.reach(frame.sender, reached.station, channel_.receiver().measure(frame, reached, draw),
                  lost,
                  chance_.bits(reached.station,
                               from_above ? Purpose::OVERHEAD_LOSS : Purpose::LOST_PULSE, draw));
}

void BoardRobots::received(const Frame &frame, const Reached &reached) {
    if (!frame.message->crc_is_right()) return;
    ChannelCounts &tally = channel_.tally();
    auto &counts = channel_.in_flight().station(reached.station).counts;
    if (frame.above > 0) {
        tally.above_received += reached.fate == Fate::CLEAR;
        counts.received += reached.fate == Fate::CLEAR;
        return;
    }
    switch (reached.fate) {
    case Fate::COLLIDED: tally.collided++; return;
    case Fate::DEAF: tally.deaf++; return;
    case Fate::LOST: tally.lost++; return;
    default: break;
    }
    tally.received++;
    counts.received++;
}

// Cells

BoardCells::BoardCells(Grid &grid, Boards &boards, KilobotChannel &channel, const Bodies &bodies,
                       const Chance &chance, uint32_t first)
    : KilobotCells(grid, channel, bodies, first),
      boards_(boards),
      chance_(chance),
      draws_(grid.layout().modules()) {}

bool BoardCells::run(Cycles turn, Cycles next) {
    // With `turn`: there is the grid's own next event, which the boards have been executed up to.
    grid_.run(std::min(turn + 1, next));
    return false;
}

/// The frame is counted by what the module does when it begins.
void BoardCells::shine_on_cell(Frame &frame, uint32_t cell, double distance_m) {
    FramesInFlight &in_flight = channel_.in_flight();
    const uint32_t station = station_of(cell), module = GridLayout::module_of(cell);
    if (!grid_.lives(module)) return;
    Reached reached = {station, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    if (!in_flight.is_dark(station)) {
        in_flight.spoil(station);
        reached.fate = Fate::COLLIDED;
    }
    bool sends = false;
    for (uint32_t i = 0; i < GridLayout::MODULE_CELLS; i++)
        sends |= in_flight.is_on_air(station_of(GridLayout::MODULE_CELLS * module + i));
    if (boards_.listening_cell(module) != GridLayout::index_in_module(cell))
        reached.fate = Fate::ELSEWHERE;
    else if (sends)
        reached.fate = Fate::DEAF;
    const uint64_t draw = draws_[module]++;
    const bool lost = chance_.uniform(module, Purpose::CELL_LOSS, draw) < grid_.infrared().loss;
    if (lost && reached.fate == Fate::CLEAR) reached.fate = Fate::LOST;
    boards_.reach(frame.sender, station, gains_.measure(reached.distance_mm, 0, 0), lost,
                  chance_.bits(station, Purpose::LOST_PULSE, draw));
    in_flight.reach(frame, reached);
}

void BoardCells::received(const Frame & /*frame*/, const Reached &reached) {
    if (count(reached)) grid_.counts.received++;
}

}  // namespace kilotwin
