#include "modules/module.h"

#include <algorithm>
#include <cstring>

#include "base/errors.h"
#include "base/message_crc.h"
#include "modules/timing.h"
#include "runtime/core/eeprom_map.h"
#include "runtime/core/light_patterns.h"

namespace kilotwin {

namespace {

constexpr Cycles LIGHTS_CYCLES = 1 * MS;   // all LEDs over the I2C bus
constexpr Cycles LOADER_BLINK = 200 * MS;  // hardware.md 3.7

/// EngineError if it is a robot's.
Program &modules_program(Program &program) {
    if (program.table().module == nullptr)
        throw EngineError(program.name() + " is a robot's program; a grid needs a module's");
    return program;
}

CellLight light_of(uint8_t color, uint8_t brightness) {
    CellLight light;
    for (uint8_t part = 0; part < 3; part++) light.rgb[part] = color_part(color, brightness, part);
    return light;
}

}  // namespace

Module::Module(ModuleContext &context, Program &program, uint32_t index, uint8_t x, uint8_t y,
               Cycles tick, Cycles power_up, uint8_t *image)
    : NativeGuest(modules_program(program), own_time_, image, calls()),
      context_(context),
      own_time_{.now = power_up, .tick_length = tick},
      power_up_(power_up),
      dwell_end_(power_up + DWELL_CYCLES),
      index_(index),
      x_(x),
      y_(y) {
    // How many turns a wait takes is found out for robots only.
    program.looks_early = false;
    switch_off();
}

// Clears what only power keeps.
void Module::switch_off() {
    program_->evict(image_);
    std::memcpy(image_, program_->initial_state(), program_->state_bytes());
    orders_init(&orders_);
    turns_ = {};
    burst_ = {};
    drop_call();
    can_inbox_.clear();
    cell_inbox_.clear();
    answers_.clear();
    busy_until_ = time_.now + INIT_CYCLES;
    state_since_ = power_up_ = time_.now;
    time_.next_tick = wake_ = NEVER;
    lights_ = {};
    sending_cells_ = buffered_ = 0;
    life_ = Life::OFF;
    asking_ = answered_ = Asking::NOTHING;
    broadcast_pending_ = loop_due_ = in_program_ = in_interrupt_ = interrupts_off_ = tick_pending_ =
        false;
    came_back();
}

void Module::reset(Cycles at) {
    time_.now = std::max(time_.now, at);
    last_tick_ = 0;
    dwell_cell_ = 0;
    dwell_end_ = time_.now + DWELL_CYCLES;
    switch_off();
}

const char *Module::state_name() const {
    static const char *const NAMES[] = {"init",
                                        "idle",
                                        "setup kilobots",
                                        "waiting for page",
                                        "bootloading kilobots",
                                        "waiting for configuration",
                                        "setup",
                                        "running",
                                        "boot loader"};
    return NAMES[orders_.state];
}

// Running ahead

Cycles Module::run(Cycles until) {
    if (life_ != Life::STOPPED && !asks()) go_on(until);
    const Cycles reached = asks() ? outgoing_.at : until;
    emit_answers(reached);
    return reached;
}

uint64_t Module::run_unheard(Cycles until) {
    unheard_ = 0;
    unheard_until_ = until;
    run(until);
    unheard_until_ = 0;
    return unheard_;
}

void Module::go_on(Cycles until) {
    if (has_nothing_before(until)) return;
    time_.until = until;
    execute();
}

// Mostly nothing is due: then the guest's memory need not be swapped in.
bool Module::has_nothing_before(Cycles until) const {
    if (until <= time_.now) return true;
    if (life_ == Life::OFF || answered_ != Asking::NOTHING) return false;
    if (next_interrupt() < until) return false;
    return !is_suspended_ ? next_pass() >= until : wake_ >= until;
}

// A frame that went out leaves only the program's callback to do, which can wait.
bool Module::may_be_left_behind() const {
    return answered_ == Asking::NOTHING ||
           (answered_ == Asking::TURN && answer_ == Answer::SENT && !is_suspended_);
}

/// The next cell's turn, if any may have something to send then.
Cycles Module::next_turn() const {
    const bool may_send = sending_cells_ != 0 || orders_.state == STATE_RUNNING;
    if (!may_send || time_.next_tick == NEVER || orders_.state == STATE_BOOT_LOADER) return NEVER;
    turns_t turns = turns_;
    if (answered_ == Asking::TURN) turns_passed(&turns);
    return time_.next_tick + (turns_ticks_to_go(&turns) - 1u) * time_.tick_length;
}

// loop() has no effect outside by itself, unless the program sends on its own (acts_alone): its
// passes wait for the next event.
Cycles Module::next_event() const {
    if (life_ == Life::STOPPED || asks()) return answers_.empty() ? NEVER : answers_.front().at;
    if (life_ == Life::OFF || !may_be_left_behind()) return time_.now;
    Cycles next = next_turn();
    if (!answers_.empty()) next = std::min(next, answers_.front().at);
    // Receptions while it sends by infrared, or starts, wait for the end of that.
    if (!can_inbox_.empty()) next = std::min(next, std::max(can_inbox_.front().at, busy_until_));
    if (!cell_inbox_.empty()) next = std::min(next, std::max(cell_inbox_.front().at, busy_until_));
    const bool looping = burst_.job == JOB_NONE && main_loop_job(&orders_) == JOB_LOOP;
    if (is_suspended_) {
        const bool matters = !looping || orders_answer_due(&orders_);
        if (matters || table().module->acts_alone != nullptr) next = std::min(next, wake_);
    } else if (!looping) {
        next = std::min(next, next_pass());
    }
    if (looping && table().module->acts_alone != nullptr) next = std::min(next, time_.next_tick);
    return std::max(next, time_.now);
}

// Lights and EEPROM

CellLight Module::breathing(Cycles at) const {
    const auto step = (at - state_since_) / BREATH_STEP % BREATH_STEPS;
    return light_of(WHITE, pattern_breath(static_cast<uint8_t>(step)));
}

// Patterns are functions of the time since the state began; nothing happens at their steps.
CellLight Module::light(uint8_t cell, Cycles at) const {
    at = std::max(at, state_since_);
    switch (orders_.state) {
    case STATE_INIT: {
        const Cycles step = (at - state_since_) / SHOW_STEP;
        if (life_ == Life::OFF || step >= SHOW_STEPS) return {};
        return light_of(pattern_show_color(static_cast<uint8_t>(step), cell), ADJUSTED);
    }
    case STATE_IDLE: return breathing(at);
    case STATE_BOOT_LOADER: {
        const bool is_lit = (at - state_since_) / LOADER_BLINK % 2 == 0;
        return light_of(is_lit ? BLUE : LED_OFF, ADJUSTED);
    }
    default: return lights_[cell];
    }
}

// Until the program writes, the content follows from the module's place and its gains.
uint8_t Module::eeprom(uint16_t address) const {
    address %= EEPROM_BYTES;
    if (eeprom_) return (*eeprom_)[address];
    if (const auto gain = gain_byte(gains_, address)) return *gain;
    if (address == EEPROM_X) return x_;
    if (address == EEPROM_Y) return y_;
    return 0xFF;  // erased
}

void Module::set_eeprom(uint16_t address, uint8_t value) {
    if (!eeprom_) {
        auto image = std::make_unique<EepromImage>();
        for (uint16_t i = 0; i < EEPROM_BYTES; i++) (*image)[i] = eeprom(i);
        eeprom_ = std::move(image);
    }
    (*eeprom_)[address % EEPROM_BYTES] = value;
}

// The program

template <typename Call> void Module::run_program(Call call) {
    in_program_ = true;
    *table().budget = TURNS_PER_TICK;
    call();
    in_program_ = false;
    came_back();
    const auto &table = program_->table();
    if (table.settle != nullptr) table.settle();
}

// Runs on the guest stack. Interrupts of a moment come before the pass of that moment.
void Module::live() {
    if (life_ == Life::OFF) {
        life_ = Life::BOOTING;
        run_program(table().program_main);
        stop(EventKind::CRASH, "main() came back: it never called module_start()");
        return;
    }
    while (asking_ == Asking::NOTHING && life_ == Life::ALIVE) {
        if (answered_ != Asking::NOTHING) settle();
        const Cycles interrupt_at = next_interrupt(), pass_at = next_pass();
        if (std::min(interrupt_at, pass_at) >= time_.until) return;
        if (interrupt_at <= pass_at) {
            serve_interrupt(interrupt_at);
        } else {
            time_.now = std::max(time_.now, pass_at);
            pass();
        }
    }
}

// The main loop

/// The next pass of the main loop that does something; time_.now if that is due.
Cycles Module::next_pass() const {
    if (burst_.job != JOB_NONE) return std::max(time_.now, burst_at_);
    switch (main_loop_job(&orders_)) {
    case JOB_NONE:
    case JOB_BREATHE: break;  // light() works it out
    case JOB_REPEAT: return repeat_at_;
    case JOB_LOOP:
        if (loop_due_) return time_.now;
        break;
    default: return time_.now;
    }
    if (!orders_answer_due(&orders_) || orders_.state == STATE_BOOT_LOADER) return NEVER;
    if (orders_.state != STATE_IDLE || orders_.reports.used > 0) return time_.now;
    // A request waits for the end of its step.
    return state_since_ + ((time_.now - state_since_) / BREATH_STEP + 1) * BREATH_STEP;
}

// A burst takes a pass a frame, so that interrupts come between its frames.
void Module::pass() {
    if (burst_.job == JOB_NONE)
        do_job(main_loop_job(&orders_));
    else if (!send_burst_frame())
        end_burst();
    else
        return;
    if (burst_.job != JOB_NONE || life_ != Life::ALIVE) return;
    if (broadcast_pending_) {
        broadcast_pending_ = false;
        emit_answers(time_.now);
        can_frames.push_back({time_.now, broadcast_});
    }
    forward_reports();
    if (orders_take_poll(&orders_)) answer_poll();
    for (uint8_t part = 0; orders_.health >> part != 0; part++)
        if (orders_take_health(&orders_, part)) answer_health(part);
}

void Module::do_job(job_t job) {
    switch (job) {
    case JOB_BEGIN:
        orders_begin(&orders_);
        follow_state(STATE_INIT);
        break;
    case JOB_REPEAT:
    case JOB_SEND_PAGE:
    case JOB_ASK_ROBOTS:
    case JOB_START_ROBOTS: burst_begin(&burst_, &orders_, job); break;
    case JOB_SET_UP: set_up(); break;
    case JOB_LOOP:
        if (loop_due_) run_loop();
        break;
    default: break;
    }
}

void Module::set_up() {
    if (orders_begin_setup(&orders_)) run_program(setup_);
    const uint8_t before = orders_.state;
    orders_end_setup(&orders_);
    follow_state(before);
}

// Calls loop(), and again at each tick up to the next one that brings more than itself. A loop()
// that took time is called again at once.
void Module::run_loop() {
    Cycles quiet_until = orders_answer_due(&orders_) ? 0 : time_.until;
    if (!can_inbox_.empty()) quiet_until = std::min(quiet_until, can_inbox_.front().at);
    if (!cell_inbox_.empty()) quiet_until = std::min(quiet_until, cell_inbox_.front().at);
    const auto &table = program_->table();
    Cycles before;
    in_program_ = true;
    *table.budget = TURNS_PER_TICK;
    do {
        before = time_.now;
        loop_due_ = false;
        loop_();
        busy_.came_back(*table.budget);
        if (table.settle != nullptr) table.settle();
    } while (time_.now == before && pass_tick(table, quiet_until));
    in_program_ = false;
    if (time_.now > before) loop_due_ = true;
}

/// Goes on to the next tick if that comes before `quiet_until` and does nothing but count.
inline bool Module::pass_tick(const kt_table_t &table, Cycles quiet_until) {
    const bool plain = turns_.increment == TICK_MATCH && !interrupts_off_ && !broadcast_pending_;
    if (time_.next_tick >= quiet_until || turns_due_at_next_tick(&turns_) || !plain) return false;
    time_.now = std::max(time_.now, time_.next_tick);
    time_.next_tick += time_.tick_length;
    turns_tick(&turns_);
    last_tick_ = *table.ticks + 1;
    *table.ticks = last_tick_;
    return true;
}

/// Shows the light that is due and sends the next frame; false: the burst is over.
bool Module::send_burst_frame() {
    const burst_light_t light = burst_light(&burst_, &orders_);
    for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++)
        if (light.cells >> cell & 1) lights_[cell] = light_of(light.color, ADJUSTED);
    burst_frame_t frame;
    if (!burst_next(&burst_, &orders_, &frame)) return false;
    frame.message.crc = crc_of(frame.message);
    ask(Asking::AT_ONCE, frame.cell, frame.message);
    return true;
}

// Records from before RUN are thrown away; loop() follows without waiting for a tick.
void Module::end_burst() {
    const uint8_t job = burst_.job;
    burst_end(&burst_, &orders_);
    repeat_at_ = time_.now + LIGHTS_CYCLES;
    if (job != JOB_START_ROBOTS) return;
    record_store_clear(&table().module->records->store);
    loop_due_ = true;
}

/// Notes a change of the state, which was `before`. The light that breathing leaves stays.
void Module::follow_state(uint8_t before) {
    if (orders_.state == before) return;
    if (before == STATE_IDLE) lights_.fill(breathing(time_.now));
    state_since_ = time_.now;
}

// Only a reset brings it back.
void Module::stop(EventKind kind, std::string text, CodePath code) {
    report(kind, std::move(text), std::move(code));
    life_ = Life::STOPPED;
    asking_ = answered_ = Asking::NOTHING;
    drop_call();
    can_inbox_.clear();
    cell_inbox_.clear();
}

void Module::report(EventKind kind, std::string text, CodePath code) {
    context_.events.push_back(
        {time_.now, index_, last_tick_, program_->name(), kind, std::move(text), std::move(code)});
}

}  // namespace kilotwin
