#include "robots/trail.h"

#include <algorithm>
#include <cstring>

#include "base/registers.h"

namespace kilotwin {

namespace {

constexpr uint16_t SRAM = atmega328p::SRAM_BEGIN;

Trail::Bytes bytes_of(const message_t &message) {
    Trail::Bytes bytes;
    std::memcpy(bytes.data(), &message, bytes.size());
    return bytes;
}

}  // namespace

Trail::Trail(const Slots &slots, uint32_t beacons, uint32_t cells, size_t capacity)
    : slots_(slots),
      beacons_from_(static_cast<uint32_t>(slots.size())),
      cells_from_(beacons_from_ + beacons),
      above_from_(cells_from_ + cells),
      capacity_(capacity),
      robots_(slots.size()) {}

void Trail::draws(uint32_t robot, std::vector<std::pair<uint32_t, uint32_t>> extents) {
    robots_[robot].draws = std::move(extents);
}

Trail::Station Trail::station(uint32_t number) const {
    if (number < beacons_from_) return {Kind::ROBOT, slots_.index_in(number)};
    if (number < cells_from_) return {Kind::BEACON, number - beacons_from_};
    if (number < above_from_) return {Kind::CELL, number - cells_from_};
    return {Kind::ABOVE, number - above_from_};
}

/// The older half goes at once, so that an entry costs the same however long a run is.
template <typename T> void Trail::keep(std::vector<T> &list, const T &entry) {
    if (list.size() >= 2 * capacity_) {
        list.erase(list.begin(), list.end() - static_cast<ptrdiff_t>(capacity_));
        forgotten_ += capacity_;
    }
    list.push_back(entry);
}

void Trail::arrived(Station from, Station to, Cycles begin, Cycles at, const message_t &message) {
    keep(arrivals_, {begin, at, from, to, bytes_of(message)});
}

void Trail::hears(uint32_t robot, Cycles at) {
    OfRobot &of = robots_[robot];
    of.heard_nth = of.heard == at ? of.heard_nth + 1 : 0;
    of.heard = at;
}

// A message's bytes are those of the variable that the program hands out, so that each byte's last
// change is kept until it is sent.
void Trail::stored(uint32_t robot, const Moment &moment, uint16_t address, uint8_t was, uint8_t now,
                   const CodePath &code) {
    OfRobot &of = robots_[robot];
    const auto draws = [&](const auto &extent) {
        return extent.first <= code[0] && code[0] < extent.second;
    };
    if (std::any_of(of.draws.begin(), of.draws.end(), draws)) {
        of.drawn = {moment.at, number_of(code), now};
        return;
    }
    const size_t place = address - SRAM;
    if (place >= of.last.size()) of.last.resize(place + 1, Write{.at = NEVER});
    Write write = write_of(of, robot, moment, code);
    write.before = of.last[place].at;
    write.address = address;
    write.was = was;
    write.now = now;
    of.last[place] = write;
    if (looks_closely_at(robot) && closely_.begin <= address && address < closely_.end)
        keep(writes_, write);
    if (moment.during != During::MESSAGE) return;
    write.what = What::CALLBACK;
    keep(writes_, write);
}

void Trail::sensed(uint32_t robot, Cycles at, int reading, const CodePath &code) {
    robots_[robot].sensed = {at, number_of(code), reading};
}

void Trail::changed(What what, uint32_t robot, const Moment &moment, uint16_t was, uint16_t now,
                    const CodePath &code) {
    OfRobot &of = robots_[robot];
    Write write = write_of(of, robot, moment, code);
    write.before = std::exchange(what == What::LED ? of.shown : of.driven, moment.at);
    write.what = what;
    write.was = was;
    write.now = now;
    keep(writes_, write);
}

void Trail::sends(uint32_t robot, Cycles at, uint16_t address, const message_t &message) {
    OfRobot &of = robots_[robot];
    const Bytes bytes = bytes_of(message);
    if (of.has_sent && of.sent == bytes) return;
    of.has_sent = true;
    of.sent = bytes;
    const uint32_t number = sendings_so_far_++;
    keep(sendings_, {at, robot, number, address, bytes});
    for (size_t i = 0; i < bytes.size() && address >= SRAM; i++) {
        const size_t place = address - SRAM + i;
        if (place >= of.last.size() || of.last[place].at == NEVER) continue;
        Write write = of.last[place];
        write.what = What::MESSAGE;
        write.sent = number;
        keep(writes_, write);
    }
}

Trail::Write Trail::write_of(OfRobot &of, uint32_t robot, const Moment &moment,
                             const CodePath &code) {
    Write write = {.at = moment.at};
    if (moment.during == During::MESSAGE) {
        write.heard = of.heard;
        write.heard_nth = of.heard_nth;
    }
    write.drawn = of.drawn;
    write.sensed = of.sensed;
    write.robot = robot;
    write.tick = moment.tick;
    write.path = number_of(code);
    write.during = moment.during;
    return write;
}

uint32_t Trail::number_of(const CodePath &code) {
    const auto [at, is_new] = numbers_.try_emplace(code, static_cast<uint32_t>(paths_.size()));
    if (is_new) paths_.push_back(code);
    return at->second;
}

}  // namespace kilotwin
