#include "grid/cell_stations.h"

#include <algorithm>
#include <cmath>

namespace kilotwin {

namespace {

// Finding the robots near each cell costs little if done rarely, and leaves few cells with a robot
// that might come near if done often.
constexpr Cycles LOOK_AROUND = 16 * TICK_CYCLES;

int16_t whole_mm(double distance_m) { return static_cast<int16_t>(std::lround(distance_m * 1000)); }

}  // namespace

void CellStations::boot(Cycles until) {
    begin_ = until;
    while (const auto asked = grid_.run(until))
        grid_.answer(asked->module, asked->emission.at, Module::Answer::SENT);
}

void CellStations::begin_step(Cycles now) {
    if ((now - begin_) % LOOK_AROUND != 0) return;
    const double way_m = bodies_.fastest_m_s() * seconds(LOOK_AROUND);
    grid_.look_around(now + LOOK_AROUND, way_m, bodies_.positions());
}

// Beside the ideal channel

bool IdealCells::run(Cycles /*turn*/, Cycles next) {
    const auto asked = grid_.run(next);
    if (!asked) return false;
    const CellEmission &sent = asked->emission;
    const uint32_t cell = GridLayout::MODULE_CELLS * asked->module + sent.cell;
    for (uint32_t robot : grid_.robots_near(cell)) {
        const double distance = distance_m(robot, cell);
        if (distance > grid_.infrared().cell_range_m || !crc_is_right(sent.message)) continue;
        channel_.deliver(robot, {Trail::Kind::CELL, cell}, sent.at, sent.message,
                         whole_mm(distance));
    }
    grid_.answer(asked->module, sent.at, Module::Answer::SENT);
    return true;
}

void IdealCells::shine_from_robot(Frame &frame, const Eigen::Vector2d &from) {
    const auto cell = grid_.layout().below(from);
    if (!cell) return;
    const int16_t mm = whole_mm(distance_m(frame.sender, *cell));
    grid_.counts.received++;
    if (Trail *const trail = channel_.trail(); trail != nullptr) [[unlikely]]
        trail->arrived(trail->station(frame.sender), {Trail::Kind::CELL, *cell}, frame.begin,
                       channel_.received_at(frame.begin), frame.message->message());
    grid_.receive_ir(channel_.received_at(frame.begin), *cell, frame.message->message(), {mm, mm},
                     !frame.message->crc_is_right());
}

// On the Kilobots' channel

void KilobotCells::shine(Frame &frame) {
    const uint32_t cell = cell_of(frame.sender);
    frame.has_orders = true;
    for (uint32_t robot : grid_.robots_near(cell)) {
        const double distance = distance_m(robot, cell);
        if (distance <= frame.range_m) channel_.shine_on_robot(frame, robot, distance);
    }
}

void KilobotCells::shine_from_robot(Frame &frame, const Eigen::Vector2d &from) {
    // Not the range among robots: a cell receives the light that leaves a robot downwards.
    const double range = grid_.range_m(frame.sender, frame.begin);
    for (uint32_t cell : grid_.cells_near(frame.sender)) {
        const double distance = (grid_.layout().centre(cell) - from).norm();
        if (distance <= range) shine_on_cell(frame, cell, distance);
    }
}

bool KilobotCells::count(const Reached &reached) {
    auto &counts = grid_.counts;
    switch (reached.fate) {
    case Fate::ELSEWHERE: counts.elsewhere++; return false;
    case Fate::DEAF: counts.deaf++; return false;
    case Fate::COLLIDED: counts.collided++; return false;
    case Fate::LOST: counts.lost++; return false;
    case Fate::CLEAR: break;
    }
    return true;
}

// Modules as guests

bool GuestCells::run(Cycles turn, Cycles next) {
    const Cycles until = std::min(turn + 1, next);
    if (grid_.next() >= until) return false;
    const auto asked = grid_.run(until);
    if (asked) begin_frame(*asked);
    return asked.has_value();
}

bool GuestCells::begins_near(uint32_t robot, Cycles until) const {
    const auto &near = grid_.cells_near(robot);
    return std::any_of(near.begin(), near.end(), [&](uint32_t cell) {
        return grid_.next_event(GridLayout::module_of(cell)) <= until;
    });
}

/// A module is about to send.
void GuestCells::begin_frame(const Grid::Question &question) {
    const uint32_t index = question.module;
    Transceiver &transceiver = transceivers_[index];
    const CellEmission &wanted = question.emission;
    const uint32_t first = GridLayout::MODULE_CELLS * index, cell = first + wanted.cell,
                   listener = first + modules_.module(index).listening_cell(wanted.at);
    // One receiver serves all cells: while it receives, the module does not try. After a reset it
    // may still be on air with what it sent before.
    if (transceiver.receiving_until > wanted.at || channel_.in_flight().is_on_air(station_of(cell)))
        return grid_.answer(index, wanted.at, Module::Answer::RECEIVING);
    const bool granted = is_channel_free(listener, wanted.at);
    if (granted && grid_.robots_near(cell).empty()) {  // no receiver, and no other sender
        transceiver.sending_until = wanted.at + FRAME_CYCLES;
        return grid_.answer(index, wanted.at, Module::Answer::SENT);
    }
    Frame &frame = channel_.begin_light(station_of(cell), wanted.at, wanted.message);
    frame.listener = station_of(listener);
    transceiver.sending_until = wanted.at + CarrierSense::WINDOW_END;
    channel_.first_pulse(frame.sender, wanted.at);
    if (!granted) return channel_.sense(frame);
    channel_.other_pulses(frame.sender, wanted.at, wanted.message);
    sensed(frame, false);
    channel_.complete_later(frame);
}

/// Whether a module that listens at `cell` from `at` on can only find the channel free.
bool GuestCells::is_channel_free(uint32_t cell, Cycles at) const {
    if (channel_.carrier_sense().held_busy()) return false;
    if (!channel_.carrier_sense().senses()) return true;
    if (!channel_.in_flight().is_dark(station_of(cell))) return false;
    const auto &near = grid_.robots_near(cell);
    return std::none_of(near.begin(), near.end(), [&](uint32_t robot) {
        return channel_.next_begin(robot) <= at + CarrierSense::WINDOW_END;
    });
}

void GuestCells::sensed(const Frame &frame, bool busy) {
    if (busy) return;
    const uint32_t module = module_of(frame.sender);
    transceivers_[module].sending_until = frame.begin + FRAME_CYCLES;
    grid_.answer(module, frame.begin, Module::Answer::SENT);
}

void GuestCells::gave_up(const Frame &frame) {
    grid_.answer(module_of(frame.sender), frame.begin, Module::Answer::BUSY);
}

/// A module receives the frame if it listens to this cell, and stays with it.
void GuestCells::shine_on_cell(Frame &frame, uint32_t cell, double distance_m) {
    const auto &settings = channel_.settings();
    FramesInFlight &in_flight = channel_.in_flight();
    const uint32_t station = station_of(cell), module = GridLayout::module_of(cell);
    Reached reached = {station, static_cast<float>(distance_m * 1000), Fate::CLEAR};
    // Other frames collide with this one even where the module does not listen.
    if (settings.collisions) in_flight.spoil(station);
    if (!grid_.lives(module) ||
        modules_.module(module).listening_cell(frame.begin) != GridLayout::index_in_module(cell))
        reached.fate = Fate::ELSEWHERE;
    else if (settings.half_duplex && transceivers_[module].sending_until > frame.begin)
        reached.fate = Fate::DEAF;
    else if (settings.collisions && !in_flight.is_dark(station))
        reached.fate = Fate::COLLIDED;
    in_flight.reach(frame, reached);
}

void GuestCells::hold_receivers(const Frame &frame, Cycles begin, Cycles end) {
    for (const Reached &reached : frame.reached) {
        if (!is_cell(reached.station) || reached.fate != Fate::CLEAR) continue;
        const uint32_t module = module_of(reached.station);
        modules_.module(module).hold_receiver(begin, end);
        auto &until = transceivers_[module].receiving_until;
        until = std::max(until, end);
    }
}

void GuestCells::received(const Frame &frame, const Reached &reached) {
    if (!count(reached)) return;
    const uint32_t module = module_of(reached.station);
    const uint64_t draw = transceivers_[module].draws++;
    if (chance_.uniform(module, Purpose::CELL_LOSS, draw) < grid_.infrared().loss) {
        grid_.counts.lost++;
        return;
    }
    grid_.counts.received++;
    if (Trail *const trail = channel_.trail(); trail != nullptr) [[unlikely]]
        trail->arrived(trail->station(frame.sender), trail->station(reached.station), frame.begin,
                       frame.begin + FRAME_CYCLES, frame.message->message());
    grid_.receive_ir(frame.begin + FRAME_CYCLES, cell_of(reached.station), frame.message->message(),
                     gains_.measure(reached.distance_mm, 0, 0), !frame.message->crc_is_right());
}

}  // namespace kilotwin
