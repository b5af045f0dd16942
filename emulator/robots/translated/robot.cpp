#include "robots/translated/robot.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <cstring>

#include "kilolib/core/sleep_rhythm.h"
#include "robots/translated/avr_calls.h"

namespace kilotwin {

using namespace atmega328p;

namespace {

constexpr uint64_t NO_TIME = TranslatedImage::NO_TIME;
constexpr uint32_t PROGRAM_COUNTER = 0x7FFE;

Debugging *debugging_of(const RobotRecord &robot) {
    Debugging *all = robot.context->debugging;
    return all != nullptr && all->holds(robot.index) ? all : nullptr;
}

WrittenBytes *written_of(const RobotRecord &robot) {
    WrittenBytes *written = robot.context->written;
    return written != nullptr && written->robot() == robot.index ? written : nullptr;
}

}  // namespace

TranslatedRobot::TranslatedRobot(TranslatedProgram &program, RobotRecord &robot,
                                 TranslatedState &state)
    : translated_chip_t{},
      program_(program),
      learned_(program.learned(robot.context->share)),
      robot_(robot),
      image_(state.image),
      rare_(state.rare),
      state_(state),
      debugging_(debugging_of(robot)),
      written_(written_of(robot)),
      code_(debugging_ != nullptr ? *program.debugged()
            : written_ != nullptr ? *program.watched()
                                  : program.code()),
      seam_(*code_.seam),
      clock_{robot.power_up, robot.tick_length} {
    data = image_.data.data();
    translated_chip_t::flags = image_.flags.data();
    flash = code_.flash;
    effects = TranslatedProgram::effects();
    pc = image_.pc;
    turns = image_.turns;
    changed = image_.changed;
    net = image_.net;
    passed = image_.passed;
    held = INT64_MAX / 2;  // how long is not known
    const bool recalls = robot.context->recalls_passes && debugging_ == nullptr;
    recalls_in = recalls ? image_.recalls_in : INT32_MAX;
    executes = !robot.context->recalls_passes;
    routines = translated_routines;
    pass = &image_.pass;
    translated_chip_t::attend = [](translated_chip_t *chip, unsigned what) -> uint8_t {
        return static_cast<TranslatedRobot *>(chip)->attend(what);
    };
    translated_chip_t::pin_written = [](translated_chip_t *chip, uint16_t address) -> uint8_t {
        return static_cast<TranslatedRobot *>(chip)->pin_written(address);
    };
    translated_chip_t::divides_by_zero = [](translated_chip_t *chip) {
        static_cast<TranslatedRobot *>(chip)->divides_by_zero();
    };
    translated_chip_t::stores = [](translated_chip_t *chip, uint16_t address, uint8_t value) {
        static_cast<TranslatedRobot *>(chip)->stores(address, value);
    };
    pushed_from = WrittenBytes::END;
    const Trail *const trail = robot.context->trail;
    if (trail != nullptr && trail->looks_closely_at(robot.index)) [[unlikely]] {
        recalls_in = INT32_MAX;
        executes = 1;
    }
    translated_chip_t::instruction_begins = [](translated_chip_t *chip) -> uint8_t {
        return static_cast<TranslatedRobot *>(chip)->instruction_begins();
    };
    const unsigned all = (1u << ENGINE_CALLS) - 1;
    calls = static_cast<uint8_t>(robot.context->gains_are_mm ? all : all & ~(1u << CALL_DISTANCE));
    limit_ = image_.cycle;
    until_ = clock_.own_cycle(robot.until);
    find_message();
    find_edge();
}

/// Interrupts come between blocks of code. A run ends where neither is left to do.
void TranslatedRobot::run() {
    if (image_.waits_for != 0) take_answer();
    while (goes_on()) {
        flag_matches();
        // One that RESET ended by a jump to address 0 has not returned.
        if (lets_interrupts() && image_.interrupt != Interrupt::NONE) end_interrupt();
        if (serve_interrupt()) continue;
        if (cycle() >= end_of_run() || is_early_) break;
        if (image_.asleep_until != 0) {
            doze();
            continue;
        }
        const uint64_t from = cycle();
        execute();
        if (cycle() == from && image_.pass_cycles != 0) break;  // it rests up to the end of the run
    }
    store();
}

uint64_t TranslatedRobot::end_of_run() const {
    return image_.interrupt == Interrupt::NONE ? until_ : until_ + INTERRUPT_BEYOND;
}

/// Hands the state back to the image, and to the robot what others read of it.
void TranslatedRobot::store() {
    image_.cycle = cycle();
    image_.pc = pc;
    image_.turns = turns;
    image_.changed = changed;
    image_.net = net;
    image_.passed = passed;
    if (recalls_in < INT32_MAX / 2) image_.recalls_in = recalls_in;
    robot_.only_ticks_until = goes_on() ? rests_until() : 0;
    robot_.has_no_message = image_.rest.request_cycles != 0;
    robot_.may_ask_now = image_.interrupt != Interrupt::NONE;
    if (seam_.robot != 0) {
        auto &core = robot_.core;
        static_assert(offsetof(robot_core_t, transmit.increment) == 10, "as avr-gcc packs it");
        std::memcpy(&core, data + seam_.robot, offsetof(robot_core_t, transmit.increment) + 1);
    }
    robot_.last_tick = ticks_now();
    const bool rests = image_.pass_cycles != 0 || image_.asleep_until != 0;
    if (robot_.question == RobotRecord::Question::NONE && robot_.life == RobotRecord::Life::ALIVE)
        robot_.now = rests ? std::max(robot_.until, world_time()) : world_time();
    robot_.next_tick = NEVER;
    robot_.holds_interrupts = false;
    if (!timer_ticks()) return;
    const uint64_t next = std::min(image_.match, image_.flagged);
    robot_.next_tick = clock_.world_time(next);
    const uint64_t since = next - image_.timer_zero;
    robot_.overflow =
        clock_.world_time(image_.timer_zero + (since / TICK_CYCLES + 1) * TICK_CYCLES);
    image_.held_back_until = held_back_until();
    const Cycles held_until = clock_.world_time(image_.held_back_until);
    robot_.holds_interrupts = image_.held_back_until > cycle();
    const Cycles now = robot_.holds_interrupts ? held_until : robot_.now;
    robot_.waits_past_tick =
        now > robot_.next_tick ? static_cast<uint32_t>(now - robot_.next_tick) : 0;
}

/// The last pass may not foretell the next one.
void TranslatedRobot::disturb_passes() {
    changed = CHANGED;
    image_.pass_cycles = 0;
    image_.rest.ends = 0;
}

/// When the next interrupt comes, as they are let through, but for edges of light.
uint64_t TranslatedRobot::next_but_edges() const {
    return std::min({image_.match, message_at_, serial_asks_at()});
}

/// Sets what execution goes on to: the next interrupt, or the end of the run. Interrupts that are
/// held back count too, unless one waits: the code that lets them through need not be left then.
void TranslatedRobot::set_limit() {
    const uint64_t end = end_of_run(), now = cycle(), was = limit_;
    uint64_t others = next_but_edges(), edge = edge_at_;
    const bool one_waits = image_.flagged != NO_TIME || std::min(others, edge) <= now;
    awaits = lets_interrupts() || !one_waits;
    if (awaits == 0) others = edge = NO_TIME;
    const uint64_t next = std::min({others, edge, image_.match});  // also if it is not let through
    const uint64_t place = place_wanted(now);
    limit_ = std::min({end, next, place});
    set_cycle(now);
    held += static_cast<int64_t>(limit_ - was);
    ends_run_ = end < std::min(next, place) && image_.interrupt == Interrupt::NONE;
    repeats = !ends_run_ && edge >= std::min(end, others);
    limit_changed_ = false;
}

/// Passes may be left out up to there, as up to an interrupt, on the way to a place that a debugger
/// wants; from there on each is executed.
uint64_t TranslatedRobot::place_wanted(uint64_t now) {
    if (debugging_ == nullptr) return NO_TIME;
    const uint64_t from = debugging_->executes_from(robot_.index);
    executes = !robot_.context->recalls_passes || from <= now;
    turns_wanted = debugging_->wants_turns();
    return from <= now ? NO_TIME : from;
}

/// Executes up to there.
void TranslatedRobot::execute() {
    if (image_.pass_cycles != 0 && lets_interrupts()) rest();
    set_limit();
    if (image_.pass_cycles != 0) {
        if (ends_run_) return;  // the rest is for later
        const uint64_t left_out = static_cast<uint64_t>(left) / image_.pass_cycles;
        left -= static_cast<int64_t>(left_out * image_.pass_cycles);
        image_.pass_begun = cycle();
        image_.pass_cycles = 0;
        image_.rest.ends = 0;
        if (left == 0) return;
    }
    pass_left = static_cast<int64_t>(limit_ - image_.pass_begun);
    execute_code();
    image_.pass_begun = limit_ - static_cast<uint64_t>(pass_left);
}

/// Passes repeat: interrupts that change nothing else put the next ones off, and that is all.
void TranslatedRobot::rest() {
    do take_edges_at_rest();
    while (take_ticks_at_rest());
}

/// Passes repeat: an edge of light in one of them puts the next ones off, and that is all. So for
/// edges before the last pass up to another interrupt. Not if a pass may lose one, and not late
/// ones, which may have taken each other's place.
void TranslatedRobot::take_edges_at_rest() {
    if (image_.holds) return;
    const uint64_t end = std::min(end_of_run(), next_but_edges());
    uint64_t now = cycle();
    while (edge_at_ < end && !edge_is_late_) {
        if (!frame_is_alone()) {
            if (!take_burst_at_rest(now, end)) break;
            continue;
        }
        if (take_frame_at_rest(now, end)) continue;
        if (const uint32_t byte = cycles_of_byte();
            byte != 0 &&
            std::max(now, edge_at_ + BYTE_SLOTS * SLOT_CYCLES) + byte + image_.pass_cycles <= end) {
            now += hears_light() ? byte : 0;
            take_byte();
            continue;
        }
        const uint64_t cycles = hears_light() ? edge_cycles_ : 0;
        if (std::max(now, edge_at_) + cycles + image_.pass_cycles > end || edge_matters()) break;
        now += cycles;
        take_edge();
    }
    limit_ = std::max(now, limit_);
    set_cycle(now);
}

/// Edges of frames that overlap, whose interrupts wait for one another, up to a moment at which
/// none waits. False, and nothing done, where one may take the place of another one of its frame:
/// that depends on where in a pass it comes.
bool TranslatedRobot::take_burst_at_rest(uint64_t &now, uint64_t end) {
    constexpr size_t MOST_FRAMES = 4;
    auto &lights = rare_->lights;
    const size_t frames = lights.size();
    if (frames > MOST_FRAMES) return false;
    std::array<SeenFrame, MOST_FRAMES> saved;
    std::copy(lights.begin(), lights.end(), saved.begin());
    uint64_t took = 0, free_at = edge_at_;
    do {
        const uint64_t cycles = hears_light() ? edge_cycles_ : 0;
        const uint64_t served = std::max(free_at, edge_at_);
        const bool fits = std::max(now + took, served) + cycles + image_.pass_cycles <= end;
        if (!fits || served + LONGEST_BLOCK >= next_of_frame() || edge_matters()) {
            lights.assign(saved.begin(), saved.begin() + frames);
            find_edge();
            return false;
        }
        free_at = served + cycles;
        took += cycles;
        take_edge();
    } while (edge_at_ < free_at + LONGEST_BLOCK);
    now += took;
    return true;
}

/// The same as a turn of run(), within a region. What needs all of the state leaves the region.
bool TranslatedRobot::attend(unsigned what) {
    note_written();
    const bool goes_on = attend_to(what);
    note_written();
    return goes_on;
}

bool TranslatedRobot::attend_to(unsigned what) {
    const uint64_t begun = limit_ - static_cast<uint64_t>(pass_left);
    if (what == END_OF_INTERRUPT)
        return_from_interrupt();
    else if (what < ENGINE_CALLS)
        call(what);
    if (!goes_on() || is_early_) return false;
    for (flag_matches(); !message_is_due() && serve_interrupt();) flag_matches();
    if (message_is_due() || cycle() >= end_of_run()) return false;
    set_limit();
    pass_left = static_cast<int64_t>(limit_ - begun);
    return left > 0;
}

/// Goes from region to region; leaves when an interrupt may be due, or what comes next depends on
/// more than code.
void TranslatedRobot::execute_code() {
    while (left > 0) {
        pc &= PROGRAM_COUNTER;
        if (pc == 0) starts_again();
        const unsigned region = code_.region_of[pc / 2];
        note_written();
        const translated_end_t end = region != 0 ? code_.code[region - 1](this) : INTERPRET_ONE;
        note_written();
        switch (end) {
        case CHECKPOINT:
            if (note_pass()) return;
            break;
        case CALL_ENGINE: call(); return;
        case ATTENDED: return;
        case INTERPRET_ONE:
            if (execute_one()) return;
            break;
        default: break;
        }
    }
}

/// Leaves one instruction to the interpreter. True if what comes next has to be found anew.
bool TranslatedRobot::execute_one() {
    constexpr uint16_t RETI = 0x9518, SLEEP = 0x9588;
    static constexpr registers_t REGISTERS = {read_register, register_written};
    if (pc == RETURN_FROM_MESSAGE && !image_.strays) {
        end_message();
        return true;
    }
    if (debugging_ != nullptr) changed |= instruction_begins();
    const bool let_interrupts = lets_interrupts();
    const int64_t from = left;
    const uint16_t word = flash_word(flash, pc);
    if (word == SLEEP && (at(SMCR) & SMCR_SE) != 0) {
        const bool down = (at(SMCR) & SMCR_SM) == SLEEP_POWER_DOWN;
        const bool rings = (at(WDTCSR) & WDTCSR_WDIE) != 0;
        image_.asleep_until = down && rings ? cycle() + SLEEP_DOWN_CYCLES : NO_TIME;
    }
    if (makes_mistake()) return true;
    changed |= NOT_COUNTED;  // whether it reads a counter, or stores one again, is not looked at
    const bool is_one = interpret(this, &REGISTERS);
    note_written();
    if (!is_one) {
        fail();
        return true;
    }
    if (let_interrupts && !lets_interrupts()) held = from;
    if (word == RETI) {
        end_interrupt();
    } else if (!let_interrupts && lets_interrupts()) {
        if (held - left > MOST_HELD) changed |= HELD;
        execute_one();  // the chip executes one more before the interrupt
    }
    return let_interrupts != lets_interrupts() || image_.asleep_until != 0 || limit_changed_;
}

/// A loop begins anew: whether all passes up to the next interrupt would do what this one did.
bool TranslatedRobot::note_pass() {
    const uint16_t stack = word(SPL);
    const uint8_t now = status();
    if (pass_cycles == TO_RECALL) {
        pass_cycles = 0;
        image_.pass_cycles = 0;
        return recall();
    }
    const uint64_t below = (changed & CHANGED_BELOW) != 0 ? translated_below(data, stack) : 0;
    const bool same =
        pass_cycles != 0 ||
        (executes == 0 && (changed & SHOWN) == 0 && translated_kept(pass, changed, net, below) &&
         pass->pc == pc && pass->stack == stack && pass->status == now &&
         std::memcmp(pass->registers, data, sizeof pass->registers) == 0);
    turns = TURNS;
    pass_cycles = 0;
    image_.pass_cycles = same ? static_cast<uint64_t>(pass_left - left) : 0;
    image_.holds = (changed & HELD) != 0;
    pass_left = left;
    if (same) return true;
    *pass = {};
    translated_compare_more(pass, 0);
    std::memcpy(pass->registers, data, sizeof pass->registers);
    pass->pc = pc;
    pass->stack = stack;
    pass->status = now;
    pass->below = below;
    changed = 0;
    net = 0;
    return false;
}

/// It sleeps until an interrupt, or in power-down until the watchdog rings; timer 0 stands still
/// then and nothing is received.
void TranslatedRobot::doze() {
    const uint64_t from = cycle();
    const bool down = (at(SMCR) & SMCR_SM) == SLEEP_POWER_DOWN;
    const uint64_t interrupt = std::min({image_.match, message_at_, edge_at_});
    if (down && message_at_ < std::min(image_.asleep_until, until_)) {
        forget_beside(robot_.inbox[robot_.inbox_next++].at);
        robot_.inbox_changed();
        find_message();
        return;
    }
    const uint64_t wakes = down ? image_.asleep_until : interrupt;
    limit_ = std::min(wakes, until_);
    left = 0;
    if (down) {
        const uint64_t stood_still = limit_ - std::min(from, limit_);
        image_.timer_zero += stood_still;
        if (image_.match != NO_TIME) image_.match += stood_still;
    }
    if (limit_ == wakes) image_.asleep_until = 0;
    disturb_passes();
}

/// Now, for the trail.
Trail::Moment TranslatedRobot::moment() const {
    constexpr auto during = [](Interrupt which) {
        switch (which) {
        case Interrupt::MESSAGE: return Trail::During::MESSAGE;
        case Interrupt::TICK: return Trail::During::TICK;
        default: return Trail::During::LOOP;
        }
    };
    return {world_time(), ticks_now(), during(image_.interrupt)};
}

/// With the function that has ended by a jump to the one at work: its call is not on the stack.
CodePath TranslatedRobot::path_here() const {
    CodePath path = avr_code_path(pc, data, flash);
    if (jumped != 0) path.insert(path.begin() + 1, jumped);
    return path;
}

/// A variable is about to change, or has, as a counter. Locals are none.
void TranslatedRobot::stores(uint16_t address, uint8_t value) {
    if (written_ != nullptr) written_->stores(address);
    Trail *const trail = robot_.context->trail;
    const bool changes = data[address] != value;
    if (trail == nullptr || address >= seam_.variables_end || !changes) return;
    trail->stored(robot_.index, moment(), address, data[address], value, path_here());
}

void TranslatedRobot::note_written() {
    if (written_ == nullptr) [[likely]]
        return;
    written_->look(data, pushed_from);
    pushed_from = WrittenBytes::END;
}

/// LED and motors were so before.
void TranslatedRobot::note_outputs(uint8_t color, uint16_t duties) {
    Trail &trail = *robot_.context->trail;
    if (robot_.color != color)
        trail.shows(robot_.index, moment(), color, robot_.color, path_here());
    if (this->duties() != duties)
        trail.drives(robot_.index, moment(), duties, this->duties(), path_here());
}

Debugging::Instruction TranslatedRobot::instruction() const {
    const bool begins_callback = image_.interrupt == Interrupt::MESSAGE && seam_.message_rx != 0 &&
                                 pc == word(seam_.message_rx) * 2u;
    return {{robot_.index, cycle()}, pc, data, robot_.color, begins_callback};
}

uint8_t TranslatedRobot::instruction_begins() {
    const bool is_wanted = debugging_->look(instruction());
    turns_wanted = debugging_->wants_turns();
    return is_wanted ? CHANGED : 0;
}

/// Its program counter points to what is no instruction: erased flash, mostly.
void TranslatedRobot::fail() {
    if (debugging_ != nullptr) debugging_->failed(instruction());
    if (written_ != nullptr) written_->fails();
    robot_.now = world_time();
    robot_.last_tick = ticks_now();
    char text[96];
    std::snprintf(text, sizeof text,
                  "it left its program: there is no instruction at address 0x%04X",
                  static_cast<unsigned>(pc));
    robot_.stop(EventKind::CRASH, text, avr_code_path(pc, data, flash));
}

}  // namespace kilotwin
