#include "avr/boards.h"

#include <algorithm>
#include <utility>

#include "engine/message_crc.h"

namespace kilotwin {

namespace {

// The overhead controller is strong and its light comes from everywhere.
constexpr distance_measurement_t FROM_ABOVE = {400, 800};
// From one of its frames to the next (hardware.md 1.11).
constexpr Cycles FRAME_PERIOD = 83'200;
// So often a message is tried in vain, until it is given up.
constexpr unsigned MOST_SPOILT = 20;
constexpr size_t LONGEST_LINE = 256;

}  // namespace

Boards::Boards(std::vector<Robot> &robots, const RobotContext &context)
    : robots_(robots),
      context_(context) {}

void Boards::add(uint32_t index, const FlashImage &flash, Cycles power_up) {
    if (place_of_.size() <= index) place_of_.resize(index + 1, -1);
    place_of_[index] = static_cast<int32_t>(places_.size());
    robots_with_.push_back(index);
    places_.emplace_back(robots_[index], flash, power_up, context_.chance);
}

void Boards::live(Cycles until) {
    for (Place &place : places_) {
        if (context_.black_box != nullptr) *context_.black_box = {place.index, place.board.tick()};
        place.board.light = place.robot.light;
        place.board.battery = place.robot.voltage(lived_until_);
        place.board.temperature = context_.temperature;
        place.board.run(until);
        take_outputs(place, until);
    }
    lived_until_ = until;
    std::stable_sort(flashes_.begin(), flashes_.end(),
                     [](const Flash &a, const Flash &b) { return a.at < b.at; });
}

/// What came to the robots from outside the medium is to go to their boards as light.
void Boards::take_messages() {
    for (Place &place : places_)
        for (const Reception &reception : place.robot.take_inbox())
            place.messages.push_back(reception);
}

void Boards::shine_message(Place &place, Cycles begin) {
    message_t message = place.messages.front().message;
    message.crc = crc_of(message);
    for (Cycles offset : pulses_of(message))
        place.board.shine({begin + offset, begin + offset + RobotBoard::SEEN_PULSE, FROM_ABOVE});
    place.light_free = std::max(place.light_free, begin + FRAME_PERIOD);
    place.shown_until = begin + FRAME_CYCLES;
    place.shows = true;
    place.spoils = false;
}

/// When a message has been shown: it is over, or has to be shown again.
void Boards::end_message(Place &place) {
    if (!place.shows || lived_until_ < place.shown_until) return;
    place.shows = false;
    if (place.spoils && ++place.spoilt < MOST_SPOILT) return;
    place.messages.pop_front();
    place.spoilt = 0;
}

void Boards::take_outputs(Place &place, Cycles until) {
    auto &outputs = place.board.outputs;
    for (const auto &motor : outputs.motors) place.robot.drive(motor);
    if (!outputs.colors.empty()) place.robot.show(outputs.colors.back().rgb);
    take_light(place, until);
    if (!outputs.serial.empty()) take_text(place);
    outputs.clear();
    if (place.failed || place.board.failure().empty()) return;
    place.failed = true;
    place.robot.crash(place.board.now(), place.board.tick(), place.board.failure());
}

/// Edges of the IR LED become flashes. One that is still on is passed on as far as it has lasted.
void Boards::take_light(Place &place, Cycles until) {
    auto flash = [&](Cycles begin, Cycles end, bool begins) {
        end = std::max(end, begin + RobotBoard::SEEN_PULSE);
        Flash out = {begin + QUANTUM, end + QUANTUM, place.index, begins, false, {}, {}};
        if (begins) out.found = place.reader.pulse(begin);
        if (out.found == PulseReader::Found::BEGIN) place.spoils = true;
        if (out.found == PulseReader::Found::MESSAGE) out.message = place.reader.message();
        flashes_.push_back(out);
    };
    const auto &edges = place.board.outputs.light;
    bool begins = false;
    for (const auto &edge : edges) {
        if (edge.on) {
            place.on_since = edge.at;
            begins = true;
        } else if (place.on_since != NEVER) {
            flash(place.on_since, edge.at, begins);
            place.on_since = NEVER;
        }
    }
    if (place.on_since != NEVER) {
        flash(place.on_since, until, begins);
        place.on_since = until;
    }
    if (place.reader.torn_off(until)) {
        place.reader.reset();
        flashes_.push_back({until + QUANTUM, until + QUANTUM, place.index, false, true, {}, {}});
    }
}

void Boards::take_text(Place &place) {
    for (const auto &serial : place.board.outputs.serial) {
        if (serial.byte != '\r') place.line += static_cast<char>(serial.byte);
        if (serial.byte != '\n' && place.line.size() < LONGEST_LINE) continue;
        place.robot.print(serial.at, place.board.tick(), std::exchange(place.line, {}));
    }
}

Boards::Flash Boards::take_flash() {
    const Flash flash = flashes_.front();
    flashes_.pop_front();
    return flash;
}

void Boards::begin_light(uint32_t station) {
    if (reached_.size() <= station) reached_.resize(station + 1);
    reached_[station].clear();
}

void Boards::reach(uint32_t station, uint32_t robot, distance_measurement_t strength, bool lost,
                   uint64_t draw) {
    // Behind the leader and the first start pulse, so that the rest is still taken for a message.
    constexpr unsigned FIRST_TO_LOSE = 3, LEAST_PULSES = 26;
    const auto which = static_cast<unsigned>(FIRST_TO_LOSE + draw % (LEAST_PULSES - FIRST_TO_LOSE));
    place(robot).spoils = true;
    reached_[station].push_back({&place(robot), strength, lost ? which : NO_PULSE});
}

void Boards::pulse(uint32_t station, Cycles begin, Cycles end, bool begins) {
    if (!reaches_any(station)) return;
    for (Reached &reached : reached_[station]) {
        reached.pulses += begins;
        if (reached.pulses - 1 != reached.lost_pulse)
            reached.place->board.shine({begin, end, reached.strength});
    }
}

void Boards::first_pulse(uint32_t station, Cycles at) {
    pulse(station, at, at + RobotBoard::SEEN_PULSE);
}

void Boards::other_pulses(uint32_t station, Cycles at, const message_t &message) {
    if (!reaches_any(station)) return;
    for (Cycles offset : pulses_of(message))
        if (offset > 0) pulse(station, at + offset, at + offset + RobotBoard::SEEN_PULSE);
}

void Boards::hold_busy() {
    constexpr Cycles FOR_EVER = Cycles{1} << 60;
    for (Place &place : places_) place.board.shine({0, FOR_EVER, FROM_ABOVE});
}

}  // namespace kilotwin
