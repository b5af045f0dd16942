// Interrupts of a translated robot, and the functions of its runtime that the engine carries out
// (translated/robot.h).
#include <algorithm>
#include <cstring>

#include "robots/native/busy_watch.h"
#include "robots/timer.h"
#include "robots/translated/avr_calls.h"
#include "robots/translated/robot.h"
#include "robots/translated/stack.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

// Cycles of interrupts and calls, counted in kilolib's machine code (firmware/kilolib/avr). The
// comparator's interrupt: the leader's start and stop; a byte's
// start and stop; a bit, and each place that it is farther; of the last stop, what is before the
// frame's end. From there to the program's callback, and behind it. Whole functions.
constexpr uint32_t LEADER_BEGIN_CYCLES = 150, LEADER_END_CYCLES = 190;
constexpr uint32_t BYTE_BEGIN_CYCLES = 106, BYTE_END_CYCLES = 164;
constexpr uint32_t BIT_CYCLES = 154, BIT_PLACE_CYCLES = 5, LAST_CYCLES = SLOT_CYCLES;
constexpr uint64_t RECEIVE_CYCLES = 172, RECEIVE_END_CYCLES = 37;
constexpr uint64_t SENSE_LIGHT_CYCLES = 9, SENSE_LOOK_CYCLES = 4, BEGAN_CALL_CYCLES = 8;
constexpr uint64_t CONVERT_CYCLES = 177, CONVERT_SLOWLY_CYCLES = 3422;
constexpr uint64_t ORIGINAL_CONVERT_CYCLES = 134, ORIGINAL_CONVERT_SLOWLY_CYCLES = 1698;
constexpr uint64_t SEND_CALL_CYCLES = 33, DISTANCE_CYCLES = 300;
// The original's message_crc(), within the comparator's interrupt, takes so much longer; and its
// estimate_distance().
constexpr uint64_t ORIGINAL_CRC_CYCLES = 40, ORIGINAL_DISTANCE_CYCLES = 3226;

// Registers that the comparator's interrupt saves, with the status register and r0, r1.
constexpr uint8_t SAVED[] = {0, 1, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 30, 31};

// A program may stay away from its main loop for so many before that is told.
constexpr uint16_t MOST_TICKS_AWAY = BusyWatch::WARN_AFTER / TICK_CYCLES;

/// Cycles for the ones in a byte, by its value.
struct CyclesOfBits {
    uint16_t of[256] = {};
    constexpr CyclesOfBits() {
        for (unsigned byte = 0; byte < 256; byte++)
            for (unsigned bit = 0; bit < 8; bit++)
                if ((byte >> bit & 1) != 0)
                    of[byte] =
                        static_cast<uint16_t>(of[byte] + BIT_CYCLES + bit * BIT_PLACE_CYCLES);
    }
};
constexpr CyclesOfBits CYCLES_OF_BITS;

/// An edge of a frame: its slot, and the cycles of its interrupt.
struct Edge {
    unsigned slot;
    uint32_t cycles;
};
constexpr Edge NO_EDGE = {FRAME_BYTES * BYTE_SLOTS, 0};

/// The first from `slot` on.
Edge edge_of(const message_t &message, unsigned slot) {
    uint8_t bytes[sizeof message];
    std::memcpy(bytes, &message, sizeof bytes);
    for (; slot < NO_EDGE.slot; slot++) {
        const unsigned byte = slot / BYTE_SLOTS, place = slot % BYTE_SLOTS;
        if (place == 0) return {slot, byte == 0 ? LEADER_BEGIN_CYCLES : BYTE_BEGIN_CYCLES};
        if (slot == NO_EDGE.slot - 1) return {slot, LAST_CYCLES};
        if (place == STOP_SLOT) return {slot, byte == 0 ? LEADER_END_CYCLES : BYTE_END_CYCLES};
        if (byte > 0 && (bytes[byte - 1] >> (place - 1) & 1) != 0)
            return {slot, BIT_CYCLES + (place - 1) * BIT_PLACE_CYCLES};
    }
    return NO_EDGE;
}

}  // namespace

// Interrupts

/// Compare matches of timer 0 up to now. One that comes while the last one waits is lost.
void TranslatedRobot::flag_matches() {
    while (image_.match <= cycle()) {
        if (image_.flagged == TranslatedImage::NO_TIME) image_.flagged = image_.match;
        image_.match += TICK_CYCLES;
        look_at_stack(word(SPL));
        watch_main_loop();
    }
}

/// At each match: says so, as of a native program, if it has not been in its main loop nor in
/// delay() for long; again if it comes back and stays away once more.
void TranslatedRobot::watch_main_loop() {
    if (passed != 0) {
        passed = 0;
        image_.ticks_away = 0;
        return;
    }
    if (image_.ticks_away == MOST_TICKS_AWAY) return;
    image_.ticks_away++;
    if (image_.ticks_away < MOST_TICKS_AWAY) return;
    robot_.last_tick = ticks_now();
    robot_.now = world_time();
    robot_.report(EventKind::BUSY_WAIT, BusyWatch::WARNING, avr_code_path(pc, data, flash));
}

/// Begins the interrupt that is due: the tick's first, whose vector is before the others'.
bool TranslatedRobot::serve_interrupt() {
    if (!lets_interrupts() || cycle() >= until_) return false;
    if (image_.flagged != TranslatedImage::NO_TIME) {
        image_.asleep_until = 0;
        if (can_count_tick())
            count_tick();
        else
            begin_interrupt(Interrupt::TICK);
        return true;
    }
    if (edge_at_ <= cycle()) {
        serve_edge();
        return true;
    }
    if (message_is_due()) {
        image_.asleep_until = 0;
        take_message();
        return true;
    }
    if (serial_asks_at() > cycle()) return false;
    begin_interrupt(Interrupt::SERIAL);
    return true;
}

/// When the serial line next asks for a byte by its interrupt.
uint64_t TranslatedRobot::serial_asks_at() const {
    return (data[UCSR0B] & UCSR0B_UDRIE) != 0 ? image_.serial_free : TranslatedImage::NO_TIME;
}

bool TranslatedRobot::ticks_are_plain() const {
    constexpr uint16_t ATTEMPTS = offsetof(robot_core_t, answer.attempts);
    return learned_.tick_cycles != 0 && data[seam_.robot + ATTEMPTS] == 0 &&
           data[OCR0A] == TICK_MATCH;
}

bool TranslatedRobot::can_count_tick() const {
    constexpr uint16_t COUNTS = offsetof(robot_core_t, transmit.counts),
                       INCREMENT = offsetof(robot_core_t, transmit.increment);
    const uint8_t *core = data + seam_.robot;
    const auto counts =
        static_cast<uint16_t>(word(static_cast<uint16_t>(seam_.robot + COUNTS)) + core[INCREMENT]);
    return ticks_are_plain() && counts <= word(seam_.tx_period);
}

/// The changes that some of these make.
void TranslatedRobot::count(uint32_t ticks) {
    const auto counts =
        static_cast<uint16_t>(seam_.robot + offsetof(robot_core_t, transmit.counts));
    const auto increment =
        static_cast<uint16_t>(seam_.robot + offsetof(robot_core_t, transmit.increment));
    const uint32_t counted = word(counts) + at(increment) + (ticks - 1) * TICK_MATCH;
    set_word(counts, static_cast<uint16_t>(counted));
    at(increment) = TICK_MATCH;
    const uint32_t now = ticks_now() + ticks;
    std::memcpy(data + seam_.ticks, &now, sizeof now);
}

/// The same by arithmetic.
void TranslatedRobot::count_tick() {
    disturb_passes();
    count(1);
    image_.flagged = TranslatedImage::NO_TIME;
    left -= static_cast<int64_t>(learned_.tick_cycles);
}

/// As the chip does: the program counter goes to the stack, and no other interrupt comes.
void TranslatedRobot::begin_interrupt(Interrupt which) {
    image_.is_timed = which == Interrupt::TICK && learned_.tick_cycles == 0;
    disturb_passes();
    image_.interrupted = cycle();
    image_.interrupt = which;
    if (which != Interrupt::SERIAL)
        program_.cover(pc, which == Interrupt::MESSAGE ? COVER_MESSAGE : COVER_TICK);
    TranslatedStack(data).push_return(pc);
    flags[7] = 0;
    if (which == Interrupt::TICK) image_.flagged = TranslatedImage::NO_TIME;
    pc = (which == Interrupt::TICK ? VECTOR_TIMER0_COMPA : VECTOR_UDRE) * VECTOR_BYTES;
}

/// By a reti, not by kilolib's receiver.
void TranslatedRobot::return_from_interrupt() {
    constexpr int RETI_CYCLES = 4;
    pc = TranslatedStack(data).pop_return();
    flags[7] = 1;
    left -= RETI_CYCLES;
    end_interrupt();
}

/// Interrupts are let through again.
void TranslatedRobot::end_interrupt() {
    const uint64_t took = cycle() - image_.interrupted;
    if (image_.interrupt == Interrupt::TICK && image_.is_timed)
        learned_.tick_cycles = static_cast<uint32_t>(took);
    image_.interrupt = Interrupt::NONE;
    image_.is_timed = image_.granted = false;
}

/// The first of the inbox: a command, or the program's. Its callback runs as within the
/// comparator's interrupt.
void TranslatedRobot::take_message() {
    const Reception reception = robot_.inbox[robot_.inbox_next++];
    robot_.inbox_changed();
    find_message();
    const bool is_light = !forget_beside(reception.at) && robot_.context->frame > 0;
    const std::optional<int16_t> high_gain =
        is_light ? take_flaw(clock_.own_cycle(reception.at - robot_.context->frame)) : std::nullopt;
    if (!hears_light() || high_gain == FlawedFrame::LOST) return;
    message_t message = reception.message;
    if (robot_.context->trail != nullptr) [[unlikely]]
        robot_.context->trail->hears(robot_.index, reception.at);
    begin_interrupt(Interrupt::MESSAGE);
    TranslatedStack stack(data);
    for (const uint8_t saved : SAVED) stack.push(data[saved]);
    stack.push(status());
    at(1) = 0;
    distance_measurement_t measured = reception.distance;
    if (high_gain) measured.high_gain = *high_gain;
    // Where the original's get_voltage() has left the converter (core/traits.h).
    if ((at(ADMUX) & ADMUX_MUX) == SENSOR_BATTERY)
        measured.high_gain = robot_.voltage(reception.at);
    at(ADMUX) = 0;
    const bool is_command = message_is_command(&message);
    robot_.delivered += is_command ? 0 : 1;
    if (is_command && robot_answer_is_heard(&message))
        robot_answer_hear(reinterpret_cast<robot_heard_t *>(data + seam_.heard), &message,
                          &measured);
    if (message.type == BOOT) {
        message.type = WAKEUP;
        robot_.note(HAS_NO_LOADER, "it runs without a boot loader, so that BOOT leaves it idle; "
                                   "robots with cpu = \"avr\" can be flashed");
    }
    std::memcpy(data + seam_.message, &message, sizeof message);
    std::memcpy(data + seam_.distance, &measured, sizeof measured);
    stack.push_return(RETURN_FROM_MESSAGE);
    set_word(24, seam_.message);
    set_word(22, seam_.distance);
    pc = is_command ? seam_.obey : word(seam_.message_rx) * 2u;
    left -= RECEIVE_CYCLES + (seam_.original != 0 ? ORIGINAL_CRC_CYCLES : 0);
}

/// Whether the message that comes at that time is one beside the medium.
bool TranslatedRobot::forget_beside(Cycles at) {
    if (rare_ == nullptr) return false;
    auto &beside = rare_->beside;
    const auto found = std::find(beside.begin(), beside.end(), at);
    if (found == beside.end()) return false;
    beside.erase(found);
    return true;
}

/// Whether the comparator makes interrupts: not while it sleeps, and not before kilo_init().
bool TranslatedRobot::hears_light() const {
    return (data[ACSR] & (ACSR_ACIE | ACSR_ACD)) == ACSR_ACIE;
}

/// The next one that is not taken, of all frames; those that are over are forgotten.
void TranslatedRobot::find_edge() {
    edge_at_ = TranslatedImage::NO_TIME;
    if (rare_ == nullptr) return;
    auto &lights = rare_->lights;
    const auto over = [](const SeenFrame &seen) { return seen.slot >= NO_EDGE.slot; };
    while (!lights.empty() && over(lights.front())) lights.erase(lights.begin());
    for (SeenFrame &seen : lights) {
        const Edge edge = edge_of(seen.message, seen.slot);
        const uint64_t came = seen.begin + edge.slot * SLOT_CYCLES,
                       at = std::max(came, seen.heard_from);
        seen.slot = static_cast<uint16_t>(edge.slot);
        if (over(seen) || at >= edge_at_) continue;
        edge_at_ = at;
        edge_is_late_ = came < at;
        edge_cycles_ = edge.cycles;
        edge_light_ = &seen;
    }
}

/// Whether no other frame's edges come up to its last one.
bool TranslatedRobot::frame_is_alone() const {
    const auto &lights = rare_->lights;
    const uint64_t last_at = edge_light_->begin + (NO_EDGE.slot - 1) * SLOT_CYCLES;
    return std::all_of(lights.begin(), lights.end(), [&](const SeenFrame &other) {
        return &other == edge_light_ || other.slot >= NO_EDGE.slot || other.begin > last_at;
    });
}

/// When the same frame's edge behind the next one comes; or NO_TIME.
uint64_t TranslatedRobot::next_of_frame() const {
    const Edge next = edge_of(edge_light_->message, edge_light_->slot + 1u);
    return next.slot < NO_EDGE.slot ? edge_light_->begin + next.slot * SLOT_CYCLES
                                    : TranslatedImage::NO_TIME;
}

/// Keeps the flag "in the leader" of the runtime's reader up to date: nothing else of it is read.
void TranslatedRobot::take_edge(uint16_t delay) {
    const unsigned slot = edge_light_->slot++;
    if (slot % BYTE_SLOTS == 0) edge_light_->start_delay = delay;
    if (slot == 0 || slot == STOP_SLOT) measures() = slot == 0 && hears_light();
    rare_->last_edge = edge_at_;
    find_edge();
}

/// Cycles of all of its edges, if it begins with the next one. The last byte is not among those,
/// since its end is the frame's.
uint32_t TranslatedRobot::cycles_of_byte() const {
    const unsigned slot = edge_light_->slot, byte = slot / BYTE_SLOTS;
    if (slot % BYTE_SLOTS != 0 || byte == FRAME_BYTES - 1) return 0;
    if (byte == 0) return LEADER_BEGIN_CYCLES + LEADER_END_CYCLES;
    const auto *bytes = reinterpret_cast<const uint8_t *>(&edge_light_->message);
    return BYTE_BEGIN_CYCLES + CYCLES_OF_BITS.of[bytes[byte - 1]] + BYTE_END_CYCLES;
}

/// Takes all edges of a frame that is alone from a byte's begin up to its last stop, if they come
/// and are served before `end`, and passes repeat; `now` is put off by their interrupts. Each edge
/// is served before the next one comes: an interrupt takes less than a slot.
bool TranslatedRobot::take_frame_at_rest(uint64_t &now, uint64_t end) {
    static_assert(LEADER_END_CYCLES < SLOT_CYCLES && BYTE_END_CYCLES < SLOT_CYCLES &&
                  BIT_CYCLES + 7 * BIT_PLACE_CYCLES < SLOT_CYCLES);
    const unsigned slot = edge_light_->slot, last = NO_EDGE.slot - 1;
    const uint64_t last_at = edge_at_ + (last - slot) * SLOT_CYCLES;
    if (slot % BYTE_SLOTS != 0 || last_at >= end) return false;
    const auto *bytes = reinterpret_cast<const uint8_t *>(&edge_light_->message);
    uint64_t cycles = slot == 0 ? LEADER_BEGIN_CYCLES + LEADER_END_CYCLES : 0;
    for (unsigned byte = std::max(slot / BYTE_SLOTS, 1u); byte < FRAME_BYTES; byte++)
        cycles += BYTE_BEGIN_CYCLES + CYCLES_OF_BITS.of[bytes[byte - 1]] + BYTE_END_CYCLES;
    cycles -= BYTE_END_CYCLES;
    // The last one that is taken comes a slot before the frame's last, at the latest.
    if (std::max(now + cycles, last_at) + image_.pass_cycles > end) return false;
    now += hears_light() ? cycles : 0;
    edge_light_->slot = static_cast<uint16_t>(last);
    edge_light_->start_delay = 0;
    find_edge();
    return true;
}

/// To the begin of the next one.
void TranslatedRobot::take_byte() {
    edge_light_->slot = static_cast<uint16_t>(edge_light_->slot + BYTE_SLOTS);
    edge_light_->start_delay = 0;
    find_edge();
}

/// The comparator's interrupt. An edge that comes while one of the same frame waits takes its
/// place; frames that overlap take their time as if each were alone.
void TranslatedRobot::serve_edge() {
    constexpr uint16_t CLI = 0x94F8;
    const uint64_t now = cycle();
    uint64_t next = TranslatedImage::NO_TIME;
    uint32_t cycles = 0;
    while (edge_at_ <= now) {
        cycles += next_of_frame() <= now ? 0 : edge_cycles_;
        next = next_of_frame();
        if (hears_light()) note_flaw(now);
        take_edge(delay_of_start(now));
    }
    if (!hears_light()) return;
    image_.asleep_until = 0;
    disturb_passes();
    left -= cycles;
    // The chip executes one more before the next interrupt, which may have to wait for long.
    if (next <= cycle() && flash_word(flash, pc) == CLI) execute_one();
}

/// The callback is over: what the interrupt saved goes back.
void TranslatedRobot::end_message() {
    TranslatedStack stack(data);
    const uint8_t saved = stack.pop();
    for (size_t i = std::size(SAVED); i-- > 0;) data[SAVED[i]] = stack.pop();
    for (unsigned flag = 0; flag < 8; flag++) flags[flag] = saved >> flag & 1;
    flags[7] = 1;
    pc = stack.pop_return();
    left -= RECEIVE_END_CYCLES;
    end_interrupt();
}

/// The status register.
uint8_t TranslatedRobot::status() const {
    uint8_t all = 0;
    for (unsigned flag = 0; flag < 8; flag++) all = static_cast<uint8_t>(all | flags[flag] << flag);
    return all;
}

void TranslatedRobot::set_word(uint16_t address, uint16_t value) {
    at(address) = static_cast<uint8_t>(value);
    at(static_cast<uint16_t>(address + 1)) = static_cast<uint8_t>(value >> 8);
}

/// The first of the inbox, in own time.
void TranslatedRobot::find_message() {
    message_at_ = robot_.next_message == NEVER ? TranslatedImage::NO_TIME
                                               : clock_.own_cycle(robot_.next_message);
}

// Calls of the engine

/// The function at the program counter.
void TranslatedRobot::call() {
    for (unsigned number = 0; number < ENGINE_CALLS; number++)
        if (seam_.calls[number] == pc) return call(number);
    fail();
}

void TranslatedRobot::call(unsigned number) {
    changed = CHANGED;
    const bool asks =
        number == CALL_SEND || (number == CALL_RECEIVING && image_.interrupt == Interrupt::TICK);
    // Light may come up to where it looks.
    const bool looks = number == CALL_CONVERT || number == CALL_RECEIVING;
    const uint64_t from = cycle() + (looks ? LOOK_CYCLES : 0);
    is_early_ = number != CALL_DISTANCE && !(asks ? is_asked_in_time() : from < until_);
    if (is_early_) return;
    switch (number) {
    case CALL_SEND: return send();
    case CALL_RECEIVING: return sense();
    case CALL_BEGAN: return frame_began();
    case CALL_CONVERT: return convert();
    default: return distance();
    }
}

/// Returns to the program.
void TranslatedRobot::come_back(uint16_t result, uint64_t cycles) {
    set_word(24, result);
    pc = TranslatedStack(data).pop_return();
    left -= static_cast<int64_t>(cycles);
}

/// The moment of a question to the channel: the interrupt's begin, unless the program's callback
/// has taken its time since.
Cycles TranslatedRobot::asked_at() const {
    const bool is_old = cycle() - image_.interrupted > INTERRUPT_BEYOND;
    return clock_.world_time(is_old ? cycle() : image_.interrupted);
}

/// Not so for one of a callback that has outlasted the run: it is asked in the next one.
bool TranslatedRobot::is_asked_in_time() const {
    return cycle() < until_ || asked_at() < robot_.until;
}

void TranslatedRobot::wait_for_answer(unsigned number, RobotRecord::Question question) {
    robot_.question = question;
    image_.waits_for = static_cast<uint8_t>(number + 1);
}

/// kilolib_infrared_receiving(): before a frame of its own the channel knows.
void TranslatedRobot::sense() {
    if (image_.interrupt == Interrupt::TICK) {
        robot_.now = asked_at();
        image_.granted = robot_.may_send();
        if (image_.granted) return come_back(0, SENSE_CALL_CYCLES);
        wait_for_answer(CALL_RECEIVING, RobotRecord::Question::MAY_ASK);
        return;
    }
    robot_.now = clock_.world_time(cycle() + SENSE_LOOK_CYCLES);
    const bool sees_light = robot_.disturbed();
    come_back(sees_light, sees_light ? SENSE_LIGHT_CYCLES : SENSE_CALL_CYCLES);
}

/// kilolib_infrared_send(message).
void TranslatedRobot::send() {
    message_t message;
    const uint16_t address = std::min<uint16_t>(word(24), SRAM_END - sizeof message);
    std::memcpy(&message, data + address, sizeof message);
    robot_.now = asked_at();
    if (robot_.context->trail != nullptr) [[unlikely]]
        robot_.context->trail->sends(robot_.index, robot_.now, address, message);
    if (image_.granted || !robot_.arbitrated) return put_on_air(message);
    robot_.outgoing = message;
    wait_for_answer(CALL_SEND, RobotRecord::Question::IS_CHANNEL_FREE);
}

/// A frame begins that no other can disturb.
void TranslatedRobot::put_on_air(const message_t &message) {
    robot_.emit(message);
    until_ = clock_.own_cycle(robot_.until);
    end_sending(true, robot_.context->frame);
}

/// The runtime drops the edge that its own frame has made, or one that has come meanwhile.
void TranslatedRobot::end_sending(bool is_sent, uint64_t cycles) {
    if (is_sent) image_.sends_until = clock_.own_cycle(asked_at() + robot_.context->frame);
    come_back(is_sent, cycles + SEND_CALL_CYCLES);
    image_.forgotten = cycle();
}

/// The channel has answered the question that the last run ended with.
void TranslatedRobot::take_answer() {
    const unsigned number = image_.waits_for - 1u;
    const bool yes = robot_.answer;
    image_.waits_for = 0;
    if (number == CALL_RECEIVING)
        come_back(!yes, yes ? SENSE_CALL_CYCLES : SENSE_LIGHT_CYCLES);
    else
        end_sending(yes, yes ? robot_.context->frame : SENSE_CYCLES);
}

/// kilolib_infrared_frame_began(): since the last call.
void TranslatedRobot::frame_began() {
    auto &asked = state_.written().light_asked;
    const Cycles from = clock_.world_time(asked), now = world_time();
    const auto &frames = robot_.frames_seen;
    const bool began = std::any_of(frames.begin(), frames.end(), [&](const auto &frame) {
        return frame.first > from && frame.first <= now;
    });
    asked = cycle();
    come_back(began, BEGAN_CALL_CYCLES);
}

/// kilolib_converter_read(channel). The lowest bit is noise, as a board's.
void TranslatedRobot::convert() {
    constexpr int MOST = 1023;
    const uint8_t channel = at(24);
    robot_.now = world_time();
    int reading = reading_of(robot_, channel, robot_.now);
    const bool is_original = seam_.original != 0, is_slow = channel == SENSOR_TEMPERATURE;
    // We read the thermometer twice, the first time to let it settle.
    robot_.rand_hard_draws += is_slow && !is_original ? 2 : 1;
    const uint64_t bits = robot_.context->chance.bits(robot_.index, Purpose::CONVERTER_NOISE,
                                                      robot_.rand_hard_draws - 1);
    reading += static_cast<int>(bits & 1) - static_cast<int>(bits >> 1 & 1);
    reading = std::clamp(reading, 0, MOST);
    const uint64_t ours =
        (is_slow ? CONVERT_SLOWLY_CYCLES : CONVERT_CYCLES) + cycles_of_triggered();
    const uint64_t originals = is_slow ? ORIGINAL_CONVERT_SLOWLY_CYCLES : ORIGINAL_CONVERT_CYCLES;
    if (is_original) at(ADMUX) = 0;
    if (robot_.context->trail != nullptr) [[unlikely]]
        robot_.context->trail->sensed(robot_.index, robot_.now, reading,
                                      avr_code_path(pc, data, flash));
    come_back(static_cast<uint16_t>(reading), is_original ? originals : ours);
    image_.converted = cycle();
    image_.conversion = static_cast<int16_t>(reading);
}

/// estimate_distance(measured), with a medium that tells millimetres.
void TranslatedRobot::distance() {
    const uint16_t address = std::min<uint16_t>(word(24), SRAM_END - 4);
    const auto high_gain = static_cast<int16_t>(word(static_cast<uint16_t>(address + 2)));
    come_back(static_cast<uint16_t>(std::clamp<int16_t>(high_gain, 0, UINT8_MAX)),
              seam_.original != 0 ? ORIGINAL_DISTANCE_CYCLES : DISTANCE_CYCLES);
}

}  // namespace kilotwin
