#include "avr/differential_test.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <utility>

#include "base/errors.h"
#include "base/message_crc.h"
#include "kilolib/core/robot_query.h"
#include "robots/native/guest.h"

namespace kilotwin {

namespace {

// An output that stands for less is on its way to another: two registers written one after the
// other, an LED that each loop() puts out and lights again.
constexpr Cycles SETTLE = CYCLES_PER_SECOND / 2000;
// Outputs of the native robot are sampled so often.
constexpr Cycles SLICE = TICK_CYCLES / 256;
// Resolution of the search for the chip's first tick.
constexpr Cycles SEARCH = 1024, LONGEST_BOOT = 10 * CYCLES_PER_SECOND;
// A message begins within this part of a tick, behind what the robot itself may send at the tick.
// Its last pulse and 15 ms of full power behind that, with all the interrupts in between, stay
// within the tick.
constexpr Cycles FIRST_BEGIN = TICK_CYCLES / 5, BEGINS = TICK_CYCLES / 8;
constexpr uint32_t SETTLE_TICKS = 2;  // from RUN on: an idle robot obeys within 10 ms
constexpr size_t RECENT_MESSAGES = 4;
// Upper bound of what the interrupts of one received message take; delay() itself is longer on the
// chip by less than 1 in DELAY_LONGER.
constexpr Cycles RECEIVING = CYCLES_PER_SECOND / 500, DELAY_LONGER = 500;
constexpr uint8_t USER_TYPES = 0x80;

}  // namespace

std::string DifferentialTest::Decision::text(Kind kind) const {
    char out[96];
    if (kind == LED) {
        std::snprintf(out, sizeof out, "LED RGB(%d,%d,%d)", value[0] & 3, value[0] >> 2 & 3,
                      value[0] >> 4 & 3);
    } else if (kind == MOTORS) {
        std::snprintf(out, sizeof out, "motors %d and %d", value[0], value[1]);
    } else {
        int length = std::snprintf(out, sizeof out, "message of type %d, data",
                                   value[sizeof(message_t::data)]);
        for (size_t i = 0; i < sizeof(message_t::data); i++)
            length += std::snprintf(out + length, sizeof out - static_cast<size_t>(length), " %02x",
                                    value[i]);
    }
    return out;
}

std::string DifferentialTest::Difference::text() const {
    auto side = [&](const std::optional<Decision> &decision) {
        static const char *const NOTHING[] = {"the LED as it was", "the motors as they were",
                                              "no message"};
        return decision ? decision->text(kind) + " at tick " + std::to_string(decision->tick)
                        : std::string(NOTHING[kind]);
    };
    return "here " + side(native) + ", on the robot " + side(avr);
}

DifferentialTest::DifferentialTest(std::unique_ptr<Driver> driver,
                                   std::shared_ptr<const FlashImage> image,
                                   const Settings &settings)
    : settings_(settings),
      chance_(settings.seed),
      image_(std::move(image)),
      calibration_{TICK_CYCLES, settings.uid, 71, 72, 68, 69, InfraredGains()},
      board_(*image_, 0, calibration_, 0, chance_),
      context_{chance_, events_, emissions_, nullptr, FRAME_CYCLES, false},
      driver_(std::move(driver)) {
    const bool is_native = driver_->tier() == Tier::NATIVE;
    if (is_native)
        board_.noise = [this](uint8_t channel, int16_t reading) {
            return noisy_reading(channel, reading);
        };
    board_.readings[SENSOR_LIGHT] = light_;
    run_at_ = 1 + static_cast<uint32_t>(settings.before_run.size());
    if (settings_.follow) {
        watch_ = std::make_unique<CallWatch>(*image_, board_);
        rand_hard_ = image_->symbol("rand_hard").value_or(0);
        watch_->watch(rand_hard_);
        for (uint16_t entry : *settings_.follow) watch_->watch(entry);
        for (const CallWatch::Sum &sum : settings_.sums) watch_->watch(sum);
    }
    find_first_tick();
    NativeGuest::serve_this_thread();
    native_.emplace(context_, *driver_, 0, calibration_, is_native ? base_ : 0);
    native_->set_light(light_);
    tick_ = 1;
    native_->run(base_ + TICK_CYCLES);
}

/// The chip reaches kilo_init() after its start-up code and the part of main() before it. A native
/// robot, which takes no time for those, is switched on so much later.
void DifferentialTest::find_first_tick() {
    const auto ticks = image_->symbol("kilo_ticks");
    if (!ticks) throw EngineError(image_->name() + " does not use kilolib, or is no .elf file");
    Cycles at = 0;
    do {
        if (at >= LONGEST_BOOT || !board_.failure().empty())
            throw EngineError(board_.failure().empty() ? "it does not call kilo_init() within 10 s"
                                                       : board_.failure());
        board_.run(at += SEARCH);
    } while (board_.read(*ticks) == 0);
    base_ = at - SEARCH - TICK_CYCLES;
}

/// rand_hard() makes a bit of two conversions that differ in their lowest bit (hardware.md 1.7):
/// they are given the bits that the native robot draws. All other readings are exact.
int16_t DifferentialTest::noisy_reading(uint8_t channel, int16_t reading) {
    if (channel != SENSOR_BATTERY || (watch_ && !watch_->inside(rand_hard_))) return reading;
    const uint64_t byte = chance_.bits(0, Purpose::RAND_HARD, noise_bits_ / 8);
    const auto bit = static_cast<int16_t>(byte >> (7 - noise_bits_ % 8) & 1);
    noise_bits_ += second_of_pair_;
    second_of_pair_ = !second_of_pair_;
    return static_cast<int16_t>((reading & ~1) | (second_of_pair_ ? bit : !bit));
}

void DifferentialTest::run(uint32_t ticks) {
    for (; ticks > 0 && avr_failure().empty(); ticks--) run_tick();
}

void DifferentialTest::run_tick() {
    const Cycles begin = base_ + tick_ * TICK_CYCLES, end = begin + TICK_CYCLES;
    light_ =
        static_cast<int16_t>(std::clamp<int>(light_ + static_cast<int>(below(41)) - 20, 0, 1023));
    board_.readings[SENSOR_LIGHT] = light_;
    native_->set_light(light_);
    if (!settings_.heard.empty() && tick_ > run_at_) {
        give_heard();
    } else if (const auto message = next_message()) {
        const auto noise = static_cast<double>(below(9)) - 4;
        give(*message,
             calibration_.gains.measure(33 + static_cast<double>(below(90)), noise / 2, noise));
    }
    const bool begins_now = tick_ == run_at_ + SETTLE_TICKS;
    // Outputs that stand when comparing begins are decisions too: the first of each kind.
    if (begins_now)
        for (Side *side : {&native_side_, &avr_side_}) {
            const bool native = side == &native_side_;
            const auto led = native ? native_->color(begin) : board_.color();
            const auto left = native ? native_->left_duty() : board_.left_duty();
            const auto right = native ? native_->right_duty() : board_.right_duty();
            observe(*side, LED, begin, {led});
            observe(*side, MOTORS, begin, {left, right});
        }
    run_native(end);
    board_.run(end);
    collect_avr();
    tick_++;
    if (tick_ <= run_at_ + SETTLE_TICKS) return;
    settle(native_side_, end);
    settle(avr_side_, end);
    if (!difference_ && avr_failure().empty() && !native_->stopped()) compare(end);
}

void DifferentialTest::give_heard() {
    if (heard_next_ == settings_.heard.size()) return;
    const Settings::Heard &next = settings_.heard[heard_next_];
    if (run_at_ + next.tick > tick_) return;
    heard_next_++;
    give(next.message, calibration_.gains.measure(next.distance_mm));
}

/// For vitals, of all robots, with some slots.
message_t DifferentialTest::question() {
    message_t message = {};
    message.type = BOOTPGM_QUERY;
    message.data[QUERY_FIRST] = ROBOT_QUERY_VITALS;
    message.data[QUERY_SLOTS] = static_cast<uint8_t>(below(6));
    message.data[QUERY_NONCE] = static_cast<uint8_t>(draw());
    message.data[QUERY_UID] = message.data[QUERY_UID + 1] = 0xFF;
    return message;
}

std::optional<message_t> DifferentialTest::next_message() {
    if (tick_ < run_at_) return settings_.before_run[tick_ - 1];
    if (tick_ == run_at_) {
        message_t run = {};
        run.type = RUN;
        return run;
    }
    if (settings_.ask_every != 0 && tick_ % settings_.ask_every == 0) return question();
    // A spell: for 30 to 329 ticks the same density of messages.
    if (tick_ >= spell_until_) {
        constexpr unsigned TALK_OF_256[] = {0, 16, 100, 230};
        talk_of_256_ = TALK_OF_256[below(std::size(TALK_OF_256))];
        spell_until_ = tick_ + 30 + static_cast<uint32_t>(below(300));
    }
    if (below(256) >= talk_of_256_) return std::nullopt;
    message_t message = {};
    if (!recent_.empty() && below(2) == 0) {
        message = recent_[below(recent_.size())];
        if (below(2) == 0) message.data[below(sizeof message.data)] = static_cast<uint8_t>(draw());
    } else {
        message.type = static_cast<uint8_t>(below(4) == 0 ? below(USER_TYPES) : below(4));
        for (uint8_t &byte : message.data)
            byte = static_cast<uint8_t>(below(2) == 0 ? below(4) : below(8) == 0 ? draw() : 0);
    }
    return message;
}

/// Gives both a message: pulses of light to the chip, a frame to the native robot.
void DifferentialTest::give(const message_t &content, distance_measurement_t strength) {
    message_t message = content;
    message.crc = crc_of(message);
    const Cycles begin = base_ + tick_ * TICK_CYCLES + FIRST_BEGIN + below(BEGINS);
    for (Cycles offset : pulses_of(message))
        board_.shine({begin + offset, begin + offset + RobotBoard::SEEN_PULSE, strength});
    if (native_->heeds_light()) native_->disturb(begin, begin + FRAME_CYCLES, message);
    native_->receive(begin + FRAME_CYCLES, message, strength);
    received_++;
}

void DifferentialTest::run_native(Cycles until) {
    for (Cycles at = until - TICK_CYCLES; at < until; at += SLICE) {
        native_->run(at + SLICE);
        collect_native(at);
    }
}

void DifferentialTest::collect_native(Cycles from) {
    observe(native_side_, LED, from, {native_->color(from)});
    observe(native_side_, MOTORS, from, {native_->left_duty(), native_->right_duty()});
    native_->motor_commands().clear();
    for (const Emission &emission : emissions_) {
        const auto *bytes = reinterpret_cast<const uint8_t *>(&emission.message);
        observe(native_side_, MESSAGE, emission.at, {bytes, bytes + sizeof emission.message});
        sent_++;
        recent_.push_back(emission.message);
        if (recent_.size() > RECENT_MESSAGES) recent_.pop_front();
    }
    emissions_.clear();
}

void DifferentialTest::collect_avr() {
    BoardOutputs &outputs = board_.outputs;
    for (const auto &color : outputs.colors) observe(avr_side_, LED, color.at, {color.rgb});
    for (const auto &motors : outputs.motors) {
        motors_.set(motors.at, motors.left, motors.right, true);
        observe(avr_side_, MOTORS, motors.at, {motors.left, motors.right});
    }
    for (const auto &light : outputs.light) {
        if (!light.on) continue;
        if (reader_.torn_off(light.at)) reader_.reset();
        if (reader_.pulse(light.at) != PulseReader::Found::MESSAGE) continue;
        const auto *bytes = reinterpret_cast<const uint8_t *>(&reader_.message());
        chip_sent_++;
        chip_sent_badly_ += reader_.message().crc != crc_of(reader_.message());
        observe(avr_side_, MESSAGE, reader_.begun_at(), {bytes, bytes + sizeof(message_t)});
    }
    outputs.clear();
}

void DifferentialTest::observe(Side &side, Kind kind, Cycles at, std::vector<uint8_t> value) {
    if (tick_ < run_at_ + SETTLE_TICKS || difference_) return;
    const uint32_t tick = tick_at(at);
    if (kind == MESSAGE) {
        side.decided[kind].push_back({tick, at, std::move(value)});
        return;
    }
    settle(side, at);
    const auto &fresh = side.fresh[kind];
    if (value != (fresh ? fresh->value : side.standing[kind]))
        side.fresh[kind] = {tick, at, std::move(value)};
}

/// Turns outputs that have stood long enough into decisions.
void DifferentialTest::settle(Side &side, Cycles now) {
    for (Kind kind : {LED, MOTORS}) {
        auto &fresh = side.fresh[kind];
        if (!fresh || now < fresh->at + SETTLE) continue;
        if (fresh->value != side.standing[kind]) {
            side.standing[kind] = fresh->value;
            side.decided[kind].push_back(std::move(*fresh));
        }
        fresh.reset();
    }
}

void DifferentialTest::compare(Cycles now) {
    for (Kind kind : {LED, MOTORS, MESSAGE}) {
        auto &natives = native_side_.decided[kind], &avrs = avr_side_.decided[kind];
        while (!natives.empty() && !avrs.empty()) {
            const Decision &native = natives.front(), &avr = avrs.front();
            if (native.value != avr.value || !same_time(native, avr)) {
                difference_ = {std::min(native.tick, avr.tick), kind, native, avr};
                return;
            }
            const auto [first, second] = std::minmax(native.at, avr.at);
            worst_lag_ = std::max(worst_lag_, second - first);
            ticks_apart_ = std::max(ticks_apart_, tick_at(second) - tick_at(first));
            compared_++;
            natives.pop_front();
            avrs.pop_front();
        }
        // The other tier may still decide the same, until its outputs up to then are settled.
        const auto &rest = natives.empty() ? avrs : natives;
        if (rest.empty() || rest.front().at + allowed(rest.front().at) + TICK_CYCLES > now)
            continue;
        const bool native = &rest == &natives;
        difference_ = {rest.front().tick, kind, std::nullopt, std::nullopt};
        (native ? difference_->native : difference_->avr) = rest.front();
        return;
    }
}

bool DifferentialTest::same_time(const Decision &native, const Decision &avr) const {
    if (native.tick == avr.tick) return true;
    const auto [first, second] = std::minmax(native.at, avr.at);
    return second - first <= allowed(second);
}

/// How far apart two equal decisions may be; 0: they have to fall in the same tick.
Cycles DifferentialTest::allowed(Cycles at) const {
    const Cycles running = at - std::min(at, base_ + run_at_ * TICK_CYCLES);
    if (!settings_.waits) return settings_.slack;
    return settings_.slack + received_ * RECEIVING + sent_ * FRAME_CYCLES + running / DELAY_LONGER;
}

uint32_t DifferentialTest::tick_at(Cycles at) const {
    return static_cast<uint32_t>((at - base_) / TICK_CYCLES);
}

// The tick that begins now is served a moment later, so it is not due yet.
uint64_t DifferentialTest::ticks_lost() const {
    const uint64_t due = tick_ - 1, served = watch_->ticks();
    return due - std::min(due, served);
}

std::string DifferentialTest::native_failure() const {
    if (!native_->stopped()) return "";
    return events_.empty() ? "it stopped" : events_.back().text;
}

}  // namespace kilotwin
