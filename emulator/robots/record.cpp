#include "robots/record.h"

#include <algorithm>

#include "robots/battery.h"
#include "robots/driver.h"

namespace kilotwin {

// Time and the channel

void RobotRecord::forget_taken() {
    if (inbox_next == 0) return;
    inbox.erase(inbox.begin(), inbox.begin() + static_cast<ptrdiff_t>(inbox_next));
    inbox_next = 0;
}

Cycles RobotRecord::next_answer() const {
    const uint16_t matches = robot_answer_matches(&core.answer);
    return matches == 0 ? NEVER : timer_match(matches, next_matches(), tick_length);
}

void RobotRecord::emit(const message_t &message) {
    Emission &emission = context->emissions.emplace_back();  // filled where it stands
    emission.at = now;
    emission.robot = index;
    emission.message = message;
    if (arbitrated) until = std::max(until, granted_until);
}

// Inputs

void RobotRecord::receive_before_others(Cycles at, const message_t &message,
                                        distance_measurement_t distance) {
    next_message = std::min(next_message, at);
    auto later = [](Cycles time, const Reception &other) { return time < other.at; };
    const auto place = std::upper_bound(inbox.begin(), inbox.end(), at, later);
    inbox.insert(place, {at, message, distance});
}

void RobotRecord::see_frame(Cycles begin, Cycles end) {
    if (frames_seen.size() == frames_seen.capacity()) {
        auto over = [this](const auto &frame) { return frame.second <= now; };
        frames_seen.erase(std::remove_if(frames_seen.begin(), frames_seen.end(), over),
                          frames_seen.end());
    }
    frames_seen.emplace_back(begin, end);
}

bool RobotRecord::disturbed() const {
    return std::any_of(frames_seen.begin(), frames_seen.end(),
                       [this](auto &frame) { return frame.first <= now && now < frame.second; });
}

uint8_t RobotRecord::eeprom(uint16_t address) const {
    address %= EEPROM_BYTES;
    return eeprom_image ? (*eeprom_image)[address] : calibrated_byte(calibration, address);
}

void RobotRecord::set_eeprom(uint16_t address, uint8_t value) {
    if (!eeprom_image) eeprom_image = Own<EepromImage>::make(eeprom_of(calibration));
    (*eeprom_image)[address % EEPROM_BYTES] = value;
}

// Outputs

int16_t RobotRecord::voltage(Cycles at) const {
    const Cycles drove = driven + (driving_since < at ? at - driving_since : 0);
    return battery_reading(drove, at > power_up ? at - power_up : 0, context->battery);
}

void RobotRecord::drive(const MotorCommand &command) {
    if (command.left == left && command.right == right) return;
    left = command.left;
    right = command.right;
    if (driving_since != NEVER) driven += command.at - driving_since;
    driving_since = left != 0 || right != 0 ? command.at : NEVER;
    motor_commands.push_back(command);
    decide(command.at);
}

void RobotRecord::show(uint8_t rgb, Cycles at) {
    if (rgb == color) return;
    color = rgb;
    decide(at);
}

// A colour is written bit by bit, a motor after the other, with a kick before: that is one.
void RobotRecord::decide(Cycles at) {
    if (decisions == 0 || at >= last_decision + TICK_CYCLES) decisions++;
    last_decision = std::max(last_decision, at);
}

void RobotRecord::stop(EventKind kind, std::string text, CodePath code) {
    report(kind, std::move(text), std::move(code));
    life = Life::STOPPED;
    if (left != 0 || right != 0) motor_commands.push_back({now, 0, 0});
    left = right = 0;
    empty_inbox();
}

void RobotRecord::empty_inbox() {
    inbox.clear();
    inbox_next = 0;
    inbox_changed();
}

void RobotRecord::deafen() {
    is_deaf = true;
    empty_inbox();
}

void RobotRecord::die() {
    stop(EventKind::FAULT, "dead");
    question = Question::NONE;
    color = 0;
}

void RobotRecord::note(uint8_t mistake, std::string text, CodePath code) {
    if (noted & mistake) return;
    noted |= mistake;
    report(EventKind::NOTE, std::move(text), std::move(code));
}

void RobotRecord::report(EventKind kind, std::string text, CodePath code) {
    context->events.push_back(
        {now, index, last_tick, driver->name(), kind, std::move(text), std::move(code)});
}

}  // namespace kilotwin
