#include "guest/module.h"

#include <algorithm>
#include <cstring>

#include "base/errors.h"
#include "base/message_crc.h"
#include "guest/fault.h"
#include "guest/timer.h"
#include "kilogrid_can.h"

namespace kilotwin {

namespace {

constexpr Cycles MS = CYCLES_PER_SECOND / 1000;
constexpr uint16_t TX_PERIOD = 977;  // units of 128 us: every 4th tick
constexpr Cycles MUX_CYCLES = 80 * COUNT_CYCLES;

// module_init() shows each colour in turn on the four cells, then takes it off again.
constexpr Cycles SHOW_STEP = 50 * MS;
constexpr uint8_t SHOW_COLORS = 3, SHOW_STEPS_PER_COLOR = 2 * CELLS_PER_MODULE;
constexpr Cycles INIT_CYCLES = SHOW_COLORS * SHOW_STEPS_PER_COLOR * SHOW_STEP;

constexpr Cycles BREATH_STEP = 70 * MS;  // a pass of the idle module's main loop
constexpr uint8_t BREATH_STEPS = 20;
constexpr Cycles LIGHTS_CYCLES = 1 * MS;  // all LEDs over the I2C bus
constexpr Cycles LOADER_BLINK = 200 * MS;
constexpr uint8_t ADJUSTED = 0x20;  // brightness, moduleLED.h
constexpr uint8_t RUNS_PER_CELL = 10;
constexpr size_t CONTROLLER_BUFFERS = 2;
// Between the frames of an answer: after the first the runtime waits; a record takes it a pass.
constexpr Cycles AFTER_START = 1 * MS, AFTER_RECORD = MS / 2;
constexpr uint8_t HEALTH_VERSION = 1;

enum : uint8_t { OFF = 0, RED = 1, GREEN = 2, YELLOW = 3, BLUE = 4, MAGENTA = 5, CYAN = 6, WHITE };
// Types that the grid adds to message.h's.
enum : uint8_t { GO_STRAIGHT = 0x7D, TURN_LEFT = 0x7E, TURN_RIGHT = 0x7F };

#define TO_MODULE(name) KILOGRID_CAN_TO_MODULE_TYPE_##name##_CHOICE
#define TO_HOST(name) KILOGRID_CAN_TO_HOST_TYPE_##name##_CHOICE

/// While it forwards a message of this type (hardware.md 3.3).
uint8_t command_color(uint8_t type) {
    switch (type) {
    case RESET: return GREEN;
    case BOOT: return BLUE;
    case BOOTPGM_PAGE:
    case BOOTPGM_SIZE: return CYAN;
    case SLEEP: return WHITE;
    case RUN: return MAGENTA;
    case CHARGE: return RED;
    case VOLTAGE:
    case CALIB:
    case GO_STRAIGHT:
    case TURN_LEFT:
    case TURN_RIGHT: return YELLOW;
    default: return OFF;
    }
}

CellLight light_of(uint8_t color, uint8_t brightness) {
    CellLight light;
    for (size_t part = 0; part < light.rgb.size(); part++)
        light.rgb[part] = color >> part & 1 ? brightness : uint8_t{0};
    return light;
}

bool is_for_own_program(uint8_t type) {
    switch (type) {
    case TO_MODULE(MODULE_BOOTPAGE):
    case TO_MODULE(MODULE_BOOTPAGE_SIZE):
    case TO_MODULE(MODULE_BOOTPAGE_NUMBER):
    case TO_MODULE(OLD_MODULE_BOOTPAGE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_SIZE):
    case TO_MODULE(OLD_MODULE_BOOTPAGE_NUMBER): return true;
    default: return false;
    }
}

template <typename Reception>
void insert_in_order(std::vector<Reception> &inbox, const Reception &reception) {
    auto later = [](const Reception &a, const Reception &b) { return a.at < b.at; };
    inbox.insert(std::upper_bound(inbox.begin(), inbox.end(), reception, later), reception);
}

Module *running_module = nullptr;

}  // namespace

/// Where the guest's calls arrive; all act on the module that runs.
struct Module::HostCalls {
    // Interrupts are off while the lights show that they work.
    static void init() {
        auto &module = *running_module;
        const auto &table = module.program_->table();
        const auto &api = *table.module;
        *table.ticks = module.last_tick_ = 0;
        *api.x = module.eeprom(EEPROM_X);
        *api.y = module.eeprom(EEPROM_Y);
        *api.uid = static_cast<uint16_t>(*api.x | *api.y << 8);
        *api.configuration_size = 0;
        for (uint8_t i = 0; i < KT_CONFIGURATION_BYTES; i++) api.configuration[i] = 0;
        *api.records = {};
        module.tx_clock_ = 0;
        module.tick_increment_ = TICK_MATCH;
        module.state_since_ = module.now_;
        module.interrupts_off_ = true;
        module.wait_until(module.now_ + INIT_CYCLES);
        module.interrupts_off_ = false;
        module.light_all(OFF, 0);
        module.next_tick_ = module.now_ + module.tick_;
        module.came_back();
    }

    static void start(void (*setup)(void), void (*loop)(void)) {
        running_module->setup_ = setup;
        running_module->loop_ = loop;
        running_module->life_ = Life::ALIVE;
        GuestStack::instance().abandon();
    }

    static void autostart() { running_module->autostart_ = true; }

    static void wait(uint32_t cycles) {
        running_module->wait_until(running_module->now_ + cycles);
        running_module->came_back();
    }

    static void outputs() {}  // a module's LEDs are not on its pins

    static uint8_t rand_hard() {
        auto &module = *running_module;
        auto bits = module.context_.chance.bits(module.index_, Purpose::MODULE_RAND_HARD,
                                                module.rand_hard_draws_++);
        wait(RAND_HARD_CYCLES);
        return static_cast<uint8_t>(bits);
    }

    static int16_t sensor(uint8_t) { return 0; }

    static uint8_t distance_mm(int16_t low_gain, int16_t high_gain) {
        if (running_module->context_.gains_are_mm)
            return static_cast<uint8_t>(std::clamp<int16_t>(high_gain, 0, UINT8_MAX));
        return running_module->gains_.estimate_mm({low_gain, high_gain});
    }

    static uint8_t eeprom_read(uint16_t address) { return running_module->eeprom(address); }
    static void eeprom_write(uint16_t address, uint8_t value) {
        running_module->set_eeprom(address, value);
    }

    static void interrupts(uint8_t on) {
        auto &module = *running_module;
        module.interrupts_off_ = !on;
        if (on && module.tick_pending_ && !module.in_interrupt_) {
            module.tick_pending_ = false;
            module.tick();
        }
    }

    static uint8_t timer0() {
        const auto &module = *running_module;
        const Cycles next = std::min(module.next_tick_, module.now_ + module.tick_);
        return static_cast<uint8_t>(
            std::min<Cycles>((module.now_ + module.tick_ - next) / COUNT_CYCLES, TICK_MATCH));
    }

    static void print(const char *text, uint32_t bytes) {
        running_module->report(EventKind::PRINT, {text, bytes});
    }

    static void spent(const uint8_t *frame) { running_module->budget_spent(frame); }

    static void unusable(const char *what) {
        running_module->stop(EventKind::CRASH, what);
        GuestStack::instance().abandon();
    }

    // Only interrupts go on: what `for (;;);` means.
    static void empty_loop() {
        running_module->report(EventKind::BUSY_WAIT, "it stays in an empty endless loop");
        for (;;) running_module->wait_until(NEVER);
    }

    static bool mistake(GuestStack::Mistake what, const void *address) {
        auto [noted, text] = explain(what, address, *running_module->program_);
        if (noted == 0) return false;
        if (!(running_module->noted_ & noted))
            running_module->report(EventKind::NOTE, std::move(text));
        running_module->noted_ |= noted;
        return true;
    }

    static void light(uint8_t cell, uint8_t red, uint8_t green, uint8_t blue) {
        if (cell < CELLS_PER_MODULE) running_module->lights_[cell] = {{red, green, blue}};
    }

    static void cell_message(uint8_t cell, const message_t *message,
                             uint16_t (*checksum)(const message_t *)) {
        if (cell >= CELLS_PER_MODULE) return;
        const auto bit = static_cast<uint8_t>(1 << cell);
        auto &sending = running_module->sending_cells_;
        sending = static_cast<uint8_t>(message != nullptr ? sending | bit : sending & ~bit);
        if (message == nullptr) return;
        auto &kept = running_module->cell_messages_[cell];
        // Most programs say the same again and again; 0 may stand for no checksum yet.
        const bool same = std::memcmp(message, &kept, offsetof(message_t, crc)) == 0;
        if (same && kept.crc != 0) return;
        kept = *message;
        kept.crc = checksum(&kept);
    }

    static void send_at_once(uint8_t cell, const message_t *message) {
        running_module->ask(Asking::AT_ONCE, cell % CELLS_PER_MODULE, *message);
        running_module->came_back();
    }

    static void can_send(const kt_can_message_t *message, uint8_t x, uint8_t y, uint8_t type) {
        auto &module = *running_module;
        const uint16_t id = kilogrid_id({x, y, type});
        if (id == KILOGRID_NO_ID) return;
        module.emit_answers(module.now_);
        module.can_frames.push_back({module.now_, frame_of(*message, id)});
    }

    static void can_broadcast(const kt_can_message_t *message) {
        running_module->broadcast_ = frame_of(*message, kilogrid_id({0, 0, ADDR_BROADCAST}));
        running_module->broadcast_pending_ = true;
    }

    static void can_address(uint16_t id, uint8_t address[3]) {
        kilogrid_address_t found = {0, 0, ADDR_BROADCAST};
        kilogrid_address(id, &found);
        address[0] = found.x;
        address[1] = found.y;
        address[2] = found.type;
    }

    static CanFrame frame_of(const kt_can_message_t &message, uint16_t id) {
        CanFrame frame;
        frame.id = id;
        frame.dlc = std::min<uint8_t>(message.header >> 1 & 0x0F, CanFrame::DATA_MAX);
        std::copy_n(message.data, frame.dlc, frame.data.begin());
        return frame;
    }
};

const kt_module_host_t Module::MODULE_HOST = {
    HostCalls::autostart,    HostCalls::light,    HostCalls::cell_message,
    HostCalls::send_at_once, HostCalls::can_send, HostCalls::can_broadcast,
    HostCalls::can_address,
};

const kt_host_t Module::HOST = {
    HostCalls::init,       HostCalls::start,       HostCalls::wait,        HostCalls::outputs,
    HostCalls::rand_hard,  HostCalls::distance_mm, HostCalls::eeprom_read, HostCalls::eeprom_write,
    HostCalls::interrupts, HostCalls::timer0,      HostCalls::sensor,      HostCalls::print,
    HostCalls::spent,      HostCalls::unusable,    &Module::MODULE_HOST,
};

Module::Module(ModuleContext &context, Program &program, uint32_t index, uint8_t x, uint8_t y,
               Cycles tick, Cycles power_up, uint8_t *image)
    : context_(context),
      program_(&program),
      image_(image),
      now_(power_up),
      tick_(tick),
      power_up_(power_up),
      mux_next_(power_up + MUX_CYCLES),
      index_(index),
      x_(x),
      y_(y) {
    if (program_->table().module == nullptr)
        throw EngineError(program_->name() + " is a robot's program; a grid needs a module's");
    *program_->table().host = &HOST;
    switch_off();
}

Module::~Module() { program_->evict(image_); }

void Module::serve_this_thread() { GuestStack::instance().serve_this_thread(); }

// All that power holds.
void Module::switch_off() {
    program_->evict(image_);
    std::memcpy(image_, program_->initial_state(), program_->state_bytes());
    transfer_init(&transfer_);
    suspended_.clear();
    can_inbox_.clear();
    cell_inbox_.clear();
    answers_.clear();
    burst_.clear();
    burst_next_ = 0;
    busy_until_ = now_ + INIT_CYCLES;
    state_since_ = power_up_ = now_;
    next_tick_ = wake_ = NEVER;
    lights_ = {};
    sending_cells_ = turn_cell_ = buffered_ = page_cell_ = pages_received_ = health_asked_ = 0;
    life_ = Life::OFF;
    state_ = State::INIT;
    asking_ = answered_ = Asking::NOTHING;
    burst_kind_ = Burst::NONE;
    autostart_ = set_up_ = started_ = poll_pending_ = page_pending_ = broadcast_pending_ = false;
    loop_due_ = in_program_ = in_interrupt_ = interrupts_off_ = tick_pending_ = false;
    came_back();
}

void Module::reset(Cycles at) {
    now_ = std::max(now_, at);
    last_tick_ = 0;
    mux_cell_ = 0;
    mux_next_ = now_ + MUX_CYCLES;
    switch_off();
}

// From within an interrupt of the module's own: its boot loader is left.
void Module::restart() {
    reset(now_);
    GuestStack::instance().abandon();
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
    return NAMES[static_cast<size_t>(state_)];
}

std::array<uint16_t, KILOGRID_FILTERS> Module::filters() const {
    std::array<uint16_t, KILOGRID_FILTERS> ids{};
    kilogrid_filters(x_, y_, ids.data());
    return ids;
}

void Module::receive_can(Cycles at, const CanFrame &frame) {
    if (life_ == Life::STOPPED || at < power_up_) return;
    if (at < busy_until_ && ++buffered_ > CONTROLLER_BUFFERS) {
        buffered_ = CONTROLLER_BUFFERS;
        counts_.frames_missed++;
        return;
    }
    insert_in_order(can_inbox_, {at, frame});
}

void Module::receive_ir(Cycles at, uint8_t cell, const message_t &message,
                        distance_measurement_t distance, bool crc_error) {
    if (life_ == Life::STOPPED || at < busy_until_ || state_ == State::BOOT_LOADER) return;
    insert_in_order(cell_inbox_, {at, message, distance, cell, crc_error});
}

void Module::hold_receiver(Cycles begin, Cycles end) {
    listening_cell(begin);
    held_from_ = begin;
    held_until_ = end;
}

uint8_t Module::listening_cell(Cycles at) {
    if (mux_next_ > at) return mux_cell_;
    // So many turns end before a moment. At the end of one that is held the cell stays.
    auto turns_before = [this](Cycles moment) {
        return moment > mux_next_ ? (moment - 1 - mux_next_) / MUX_CYCLES + 1 : 0;
    };
    const Cycles turns = turns_before(at + 1);
    Cycles held = 0;
    if (held_until_ > mux_next_)
        held = std::min(turns_before(held_until_), turns) -
               std::min(turns_before(held_from_ + 1), turns);
    mux_cell_ = static_cast<uint8_t>((mux_cell_ + turns - held) % CELLS_PER_MODULE);
    mux_next_ += turns * MUX_CYCLES;
    return mux_cell_;
}

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
    until_ = until;
    running_module = this;
    program_->make_resident(image_);
    auto &stack = GuestStack::instance();
    stack.set_handlers(HostCalls::empty_loop, HostCalls::mistake);
    GuestStack::Outcome outcome;
    do {
        outcome =
            suspended_.empty() ? stack.call(body, this, suspended_) : stack.resume(suspended_);
        if (outcome == GuestStack::Outcome::ABANDONED) in_program_ = in_interrupt_ = false;
    } while (outcome == GuestStack::Outcome::ABANDONED && life_ != Life::STOPPED && now_ < until);
    if (outcome == GuestStack::Outcome::FAULT) {
        auto [kind, text] = explain(stack.fault(), *program_);
        stop(kind, std::move(text));
    }
    running_module = nullptr;
}

bool Module::has_nothing_before(Cycles until) const {
    if (until <= now_) return true;
    if (life_ == Life::OFF || answered_ != Asking::NOTHING) return false;
    if (next_interrupt() < until) return false;
    return suspended_.empty() ? next_pass() >= until : wake_ >= until;
}

Cycles Module::next_event() const {
    if (life_ == Life::STOPPED || asks()) return answers_.empty() ? NEVER : answers_.front().at;
    if (life_ == Life::OFF || !may_be_left_behind()) return now_;
    Cycles next = next_turn();
    if (!answers_.empty()) next = std::min(next, answers_.front().at);
    // What came while it sends by infrared, or starts, waits for the end of that.
    if (!can_inbox_.empty()) next = std::min(next, std::max(can_inbox_.front().at, busy_until_));
    if (!cell_inbox_.empty()) next = std::min(next, std::max(cell_inbox_.front().at, busy_until_));
    const bool looping = state_ == State::RUNNING && started_ && burst_kind_ == Burst::NONE;
    if (!suspended_.empty()) {
        const bool matters = !looping || poll_pending_ || health_asked_ != 0;
        if (matters || program_->table().module->acts_alone != nullptr)
            next = std::min(next, wake_);
    } else if (!looping) {
        next = std::min(next, next_pass());
    }
    if (looping && program_->table().module->acts_alone != nullptr)
        next = std::min(next, next_tick_);
    return std::max(next, now_);
}

CellLight Module::light(uint8_t cell, Cycles at) const {
    const Cycles passed = at > state_since_ ? at - state_since_ : 0;
    switch (state_) {
    case State::INIT: {
        const Cycles step = passed / SHOW_STEP;
        const auto color = static_cast<uint8_t>(step / SHOW_STEPS_PER_COLOR);
        const auto shown = static_cast<uint8_t>(step % SHOW_STEPS_PER_COLOR);
        const bool lit = shown < CELLS_PER_MODULE ? cell <= shown : cell > shown - CELLS_PER_MODULE;
        if (life_ == Life::OFF || color >= SHOW_COLORS || !lit) return {};
        return light_of(static_cast<uint8_t>(1 << color), ADJUSTED);
    }
    case State::IDLE: {
        const auto step = static_cast<uint8_t>(passed / BREATH_STEP % (2 * BREATH_STEPS));
        return light_of(WHITE, step <= BREATH_STEPS ? step : uint8_t(2 * BREATH_STEPS - step));
    }
    case State::BOOT_LOADER: return light_of(passed / LOADER_BLINK % 2 == 0 ? BLUE : OFF, ADJUSTED);
    default: return lights_[cell];
    }
}

uint8_t Module::eeprom(uint16_t address) const {
    address %= EEPROM_BYTES;
    if (eeprom_) return (*eeprom_)[address];
    constexpr uint16_t TABLE_BYTES = 2 * InfraredGains::ENTRIES;
    auto word = [address](uint16_t base, uint16_t value) {
        return static_cast<uint8_t>((address - base) % 2 == 0 ? value >> 8 : value);
    };
    if (address >= EEPROM_LOW_GAIN && address < EEPROM_LOW_GAIN + TABLE_BYTES)
        return word(EEPROM_LOW_GAIN, gains_.low((address - EEPROM_LOW_GAIN) / 2));
    if (address >= EEPROM_HIGH_GAIN && address < EEPROM_HIGH_GAIN + TABLE_BYTES)
        return word(EEPROM_HIGH_GAIN, gains_.high((address - EEPROM_HIGH_GAIN) / 2));
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

void Module::body(void *module) { static_cast<Module *>(module)->live(); }

void Module::live() {
    if (life_ == Life::OFF) {
        life_ = Life::BOOTING;
        run_program(program_->table().program_main);
        stop(EventKind::CRASH, "main() came back: it never called module_start()");
        return;
    }
    while (asking_ == Asking::NOTHING && life_ == Life::ALIVE) {
        if (answered_ != Asking::NOTHING) settle();
        const Cycles interrupt_at = next_interrupt(), pass_at = next_pass();
        if (std::min(interrupt_at, pass_at) >= until_) return;
        if (interrupt_at <= pass_at) {
            serve_interrupt(interrupt_at);
        } else {
            now_ = std::max(now_, pass_at);
            pass();
        }
    }
}

template <typename Call> void Module::run_program(Call call) {
    in_program_ = true;
    *program_->table().budget = TURNS_PER_TICK;
    call();
    in_program_ = false;
    came_back();
    const auto &table = program_->table();
    if (table.settle != nullptr) table.settle();
}

// The main loop

/// When the main loop has something to do next; it does nothing else meanwhile.
Cycles Module::next_pass() const {
    if (burst_kind_ != Burst::NONE) return now_;
    switch (state_) {
    case State::INIT: return now_;
    case State::SETUP_KILOBOTS: return repeat_at_;
    case State::BOOTLOADING_KILOBOTS:
        if (page_pending_) return now_;
        break;
    case State::SETUP:
        if (!set_up_ || autostart_) return now_;
        break;
    case State::RUNNING:
        if (!started_ || loop_due_) return now_;
        break;
    case State::BOOT_LOADER: return NEVER;
    default: break;
    }
    if (!poll_pending_ && health_asked_ == 0) return NEVER;
    if (state_ != State::IDLE) return now_;
    // It waits for the end of its step.
    return state_since_ + ((now_ - state_since_) / BREATH_STEP + 1) * BREATH_STEP;
}

void Module::pass() {
    if (burst_kind_ != Burst::NONE) {
        if (burst_next_ < burst_.size()) return send_burst_frame();
        end_burst();
    } else {
        pass_of_state();
    }
    if (burst_kind_ != Burst::NONE || life_ != Life::ALIVE) return;
    if (broadcast_pending_) {
        broadcast_pending_ = false;
        emit_answers(now_);
        can_frames.push_back({now_, broadcast_});
    }
    if (poll_pending_) answer_poll();
    if (health_asked_ != 0) answer_health();
}

void Module::pass_of_state() {
    switch (state_) {
    case State::INIT: return enter(autostart_ ? State::SETUP : State::IDLE);
    case State::SETUP_KILOBOTS: return begin_repetition();
    case State::BOOTLOADING_KILOBOTS:
        if (page_pending_) begin_page();
        return;
    case State::SETUP:
        if (!set_up_) {
            set_up_ = true;
            run_program(setup_);
        }
        if (autostart_ && state_ == State::SETUP) enter(State::RUNNING);
        return;
    case State::RUNNING:
        if (!started_) return start_running();
        if (loop_due_) run_loop();
        return;
    default: return;
    }
}

// Calls loop(), and again at each tick up to the next one that brings more than itself.
void Module::run_loop() {
    Cycles quiet_until = poll_pending_ || health_asked_ != 0 ? 0 : until_;
    if (!can_inbox_.empty()) quiet_until = std::min(quiet_until, can_inbox_.front().at);
    if (!cell_inbox_.empty()) quiet_until = std::min(quiet_until, cell_inbox_.front().at);
    const auto &table = program_->table();
    Cycles before;
    in_program_ = true;
    *table.budget = TURNS_PER_TICK;
    do {
        before = now_;
        loop_due_ = false;
        loop_();
        busy_.came_back(*table.budget);
        if (table.settle != nullptr) table.settle();
    } while (now_ == before && pass_tick(table, quiet_until));
    in_program_ = false;
    if (now_ > before) loop_due_ = true;
}

/// Goes on to the next tick if that comes before `quiet_until` and does nothing but count.
inline bool Module::pass_tick(const kt_table_t &table, Cycles quiet_until) {
    const auto tx_clock = static_cast<uint16_t>(tx_clock_ + TICK_MATCH);
    const bool plain = tick_increment_ == TICK_MATCH && !interrupts_off_ && !broadcast_pending_;
    if (next_tick_ >= quiet_until || tx_clock > TX_PERIOD || !plain) return false;
    now_ = std::max(now_, next_tick_);
    next_tick_ += tick_;
    tx_clock_ = tx_clock;
    last_tick_ = *table.ticks + 1;
    *table.ticks = last_tick_;
    return true;
}

void Module::begin_repetition() {
    message_t message{};
    std::copy_n(transfer_.ir.data, sizeof message.data, message.data);
    message.type = transfer_.ir.type;
    message.crc = crc_of(message);
    burst_.clear();
    for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++) burst_.push_back({cell, message});
    burst_next_ = 0;
    burst_kind_ = Burst::REPETITION;
}

// The robots are told first.
void Module::start_running() {
    started_ = true;
    light_all(MAGENTA, ADJUSTED);
    message_t message{};
    std::copy_n(transfer_.ir.data, sizeof message.data, message.data);
    message.type = RUN;
    message.crc = crc_of(message);
    burst_.clear();
    for (uint8_t i = 0; i < RUNS_PER_CELL; i++)
        for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++) burst_.push_back({cell, message});
    burst_next_ = 0;
    burst_kind_ = Burst::START;
}

// A page goes out through one cell; before the first one, how many there are (hardware.md 3.7).
void Module::begin_page() {
    constexpr uint8_t WORD_BYTES = 2;
    const auto &kilo = transfer_.kilo;
    page_pending_ = false;
    burst_.clear();
    burst_next_ = 0;
    burst_kind_ = Burst::PAGE;
    message_t message{};
    if (pages_received_ == 1) {
        message.type = BOOTPGM_SIZE;
        message.data[0] = kilo.pages;
        message.crc = crc_of(message);
        burst_.push_back({page_cell_, message});
        light_all(OFF, 0);
    }
    message.type = BOOTPGM_PAGE;
    message.data[0] = kilo.page;
    for (uint8_t at = 0; at < TRANSFER_PAGE_BYTES; at += TRANSFER_CHUNK_BYTES) {
        const int left = std::min(TRANSFER_PAGE_BYTES - at, TRANSFER_CHUNK_BYTES);
        message.data[1] = at / WORD_BYTES;
        std::fill_n(message.data + 2, TRANSFER_CHUNK_BYTES, uint8_t{0});
        std::copy_n(kilo.data + at, left, message.data + 2);
        message.crc = crc_of(message);
        burst_.push_back({page_cell_, message});
    }
}

void Module::end_page() {
    lights_[page_cell_] = light_of(transfer_.kilo.page % 2 == 0 ? BLUE : GREEN, ADJUSTED);
    if (pages_received_ < transfer_.kilo.pages) return;
    pages_received_ = 0;
    light_all(OFF, 0);
    page_cell_ = (page_cell_ + 1) % CELLS_PER_MODULE;
}

void Module::send_burst_frame() {
    const CellMessage &next = burst_[burst_next_++];
    ask(Asking::AT_ONCE, next.cell, next.message);
}

void Module::end_burst() {
    const Burst kind = burst_kind_;
    burst_kind_ = Burst::NONE;
    switch (kind) {
    case Burst::REPETITION:
        repeat_at_ = now_ + LIGHTS_CYCLES;
        if (state_ == State::SETUP_KILOBOTS) light_all(command_color(transfer_.ir.type), ADJUSTED);
        return;
    case Burst::START:
        *program_->table().module->records = {};
        loop_due_ = true;
        return;
    case Burst::PAGE: return end_page();
    case Burst::NONE: return;
    }
}

void Module::enter(State state) {
    if (state_ == State::IDLE && state != State::IDLE)
        for (uint8_t cell = 0; cell < CELLS_PER_MODULE; cell++) lights_[cell] = light(cell, now_);
    if (state != state_) state_since_ = now_;
    if (state != State::RUNNING) started_ = false;
    if (state == State::SETUP_KILOBOTS) repeat_at_ = now_;
    state_ = state;
}

void Module::light_all(uint8_t color, uint8_t brightness) {
    lights_.fill(light_of(color, brightness));
}

// Interrupts

Cycles Module::next_interrupt() const {
    if (interrupts_off_) return next_tick_;
    Cycles next = next_tick_;
    if (!can_inbox_.empty()) next = std::min(next, can_inbox_.front().at);
    if (!cell_inbox_.empty()) next = std::min(next, cell_inbox_.front().at);
    return next;
}

void Module::serve_interrupt(Cycles at) {
    now_ = std::max(now_, at);
    if (at == next_tick_) {
        next_tick_ += tick_;
        if (interrupts_off_)
            tick_pending_ = loop_due_ = true;
        else
            tick();
    } else if (!can_inbox_.empty() && at == can_inbox_.front().at) {
        take_can();
    } else {
        take_cell_message();
    }
}

// Runs a callback with interrupts off and a budget of its own.
template <typename Callback> void Module::interrupt(Callback callback) {
    const bool nested = in_program_;
    const auto &table = program_->table();
    const int32_t budget = *table.budget;
    in_interrupt_ = in_program_ = true;
    *table.budget = TURNS_PER_TICK;
    callback();
    *table.budget = budget;
    in_interrupt_ = interrupts_off_ = false;
    in_program_ = nested;
    if (table.settle != nullptr) table.settle();
}

void Module::tick() {
    const auto &table = program_->table();
    last_tick_ = *table.ticks + 1;
    *table.ticks = last_tick_;
    loop_due_ = true;
    tx_clock_ = static_cast<uint16_t>(tx_clock_ + tick_increment_);
    tick_increment_ = TICK_MATCH;
    if (tx_clock_ > TX_PERIOD) take_turn();
}

// A frame that went out leaves nothing to do but to tell the program, which can wait.
bool Module::may_be_left_behind() const {
    return answered_ == Asking::NOTHING ||
           (answered_ == Asking::TURN && answer_ == Answer::SENT && suspended_.empty());
}

/// When the next cell has its turn, if any may have something to send then.
Cycles Module::next_turn() const {
    const bool may_send = sending_cells_ != 0 || state_ == State::RUNNING;
    if (!may_send || next_tick_ == NEVER || state_ == State::BOOT_LOADER) return NEVER;
    const int clock = answered_ == Asking::TURN ? 0 : tx_clock_;
    const int missing = TX_PERIOD - clock - tick_increment_;
    return missing < 0 ? next_tick_
                       : next_tick_ + static_cast<Cycles>(missing / TICK_MATCH + 1) * tick_;
}

void Module::take_turn() {
    const auto cell = static_cast<uint8_t>((turn_cell_ + 1) % CELLS_PER_MODULE);
    if (sending_cells_ >> cell & 1) return ask(Asking::TURN, cell, cell_messages_[cell]);
    turn_cell_ = cell;
    tx_clock_ = 0;
}

// The main loop asks and lets go; a program that waits, or sends by itself, waits for the answer.
void Module::ask(Asking why, uint8_t cell, const message_t &message) {
    outgoing_ = {now_, cell, message};
    asking_ = why;
    if (now_ + FRAME_CYCLES < unheard_until_) {
        unheard_++;
        answer(Answer::SENT);
    }
    if (!in_program_) return;
    while (asking_ != Asking::NOTHING) GuestStack::instance().suspend();
    settle();
}

void Module::answer(Answer answer) {
    answer_ = answer;
    answered_ = asking_;
    asking_ = Asking::NOTHING;
    if (answer == Answer::SENT) keep_busy(now_ + FRAME_CYCLES);
}

void Module::settle() {
    const Asking why = answered_;
    answered_ = Asking::NOTHING;
    if (answer_ != Answer::SENT && why == Asking::AT_ONCE) now_ += SENSE_CYCLES;
    if (why == Asking::AT_ONCE || answer_ == Answer::RECEIVING) return;
    turn_cell_ = outgoing_.cell;
    tx_clock_ = 0;
    if (answer_ == Answer::SENT) {
        const auto &api = *program_->table().module;
        interrupt([&api, this] { (*api.ir_tx_success)(turn_cell_); });
        return;
    }
    // The failed attempt starts the timer anew with a compare value of libc's rand(): the next
    // match comes soon and counts as a tick.
    now_ += SENSE_CYCLES;
    const int drawn = (*program_->table().random)() & TICK_MATCH;
    tick_increment_ = static_cast<uint16_t>(drawn == 0 ? TICK_MATCH + 1 : drawn);
    next_tick_ = now_ + tick_increment_ * COUNT_CYCLES;
}

// Meanwhile the CAN controller has room for two frames, and nobody is heard.
void Module::keep_busy(Cycles until) {
    now_ = busy_until_ = until;
    buffered_ = 0;
    auto kept = can_inbox_.begin();
    for (const auto &reception : can_inbox_) {
        const bool early = reception.at < busy_until_;
        if (early && buffered_ == CONTROLLER_BUFFERS) {
            counts_.frames_missed++;
            continue;
        }
        buffered_ = static_cast<uint8_t>(buffered_ + early);
        *kept++ = reception;
    }
    can_inbox_.erase(kept, can_inbox_.end());
    std::erase_if(cell_inbox_,
                  [this](const auto &reception) { return reception.at < busy_until_; });
}

void Module::take_cell_message() {
    const CellReception reception = cell_inbox_.front();
    cell_inbox_.erase(cell_inbox_.begin());
    const auto &table = program_->table();
    const uint8_t cell = reception.cell % CELLS_PER_MODULE;
    table.rx_message[cell] = reception.message;
    *table.rx_distance = reception.distance;
    interrupt([&table, &reception, cell] {
        (*table.module->ir_rx)(&table.rx_message[cell], cell, table.rx_distance,
                               reception.crc_error);
    });
}

// CAN

void Module::take_can() {
    const CanFrame frame = can_inbox_.front().frame;
    can_inbox_.erase(can_inbox_.begin());
    if (frame.rtr || frame.dlc == 0) {
        counts_.frames_refused++;
        return;
    }
    if (state_ == State::BOOT_LOADER) {
        if (obey_as_boot_loader(frame)) restart();
    } else {
        obey(frame);
    }
}

void Module::obey(const CanFrame &frame) {
    const uint8_t type = frame.data[0];
    if (is_for_own_program(type)) return hand_over(frame);
    const auto event = transfer_receive(&transfer_, frame.data.data(), frame.dlc);
    if (event != TRANSFER_NOT_MINE) return transferred(event);
    switch (type) {
    case TO_MODULE(FORWARD_IR_MESSAGE_STOP):
        transfer_.ir = {};
        sending_cells_ = 0;
        break;
    case TO_MODULE(MODULE_BOOT):
        enter(State::BOOT_LOADER);
        next_tick_ = NEVER;
        burst_kind_ = Burst::NONE;
        suspended_.clear();
        GuestStack::instance().abandon();
    case TO_MODULE(MODULE_IDLE): break;
    case TO_MODULE(MODULE_SETUP): transfer_abandon_config(&transfer_); return enter(State::SETUP);
    case TO_MODULE(MODULE_RUN): transfer_abandon_config(&transfer_); return enter(State::RUNNING);
    case TO_MODULE(MODULE_PAUSE): return;
    case TO_MODULE(TRACKING_REQ): poll_pending_ = true; return;
    case TO_MODULE(MODULE_DATA):
        if (frame.data[1] > 1)
            counts_.frames_refused++;
        else
            health_asked_ = static_cast<uint8_t>(health_asked_ | 1 << frame.data[1]);
        return;
    default: return hand_over(frame);
    }
    transfer_abandon_config(&transfer_);
    enter(State::IDLE);
}

void Module::transferred(transfer_event_t event) {
    const auto &api = *program_->table().module;
    switch (event) {
    case TRANSFER_CONFIG_BEGUN:
        *api.configuration_size = transfer_.config.size;
        return enter(State::WAITING_FOR_CONFIGURATION);
    case TRANSFER_CONFIG_DONE:
        for (uint8_t i = 0; i < transfer_.config.size; i++)
            api.configuration[i] = transfer_.config.data[i];
        set_up_ = false;
        return enter(State::SETUP);
    case TRANSFER_IR_DONE: return forward_message();
    case TRANSFER_PAGE_BEGUN:
        transfer_abandon_config(&transfer_);
        return enter(State::WAITING_FOR_PAGE);
    case TRANSFER_PAGE_DONE:
        pages_received_++;
        page_pending_ = true;
        return enter(State::BOOTLOADING_KILOBOTS);
    case TRANSFER_REFUSED: counts_.frames_refused++; return;
    default: return;
    }
}

// Some modules are told by their EEPROM that calibration is for their neighbours only.
void Module::forward_message() {
    const uint8_t type = transfer_.ir.type;
    const bool outside = x_ < eeprom(EEPROM_CALIB_X_MIN) || x_ > eeprom(EEPROM_CALIB_X_MAX) ||
                         y_ < eeprom(EEPROM_CALIB_Y_MIN) || y_ > eeprom(EEPROM_CALIB_Y_MAX);
    if (type == CALIB && eeprom(EEPROM_CALIB_RESTRICTED) == 1 && outside) return;
    if (type == BOOT) page_cell_ = pages_received_ = 0;
    transfer_abandon_config(&transfer_);
    enter(State::SETUP_KILOBOTS);
}

/// Whether it is left: when the last page is in, or by a command. The program stays the one that
/// was built for the emulator.
bool Module::obey_as_boot_loader(const CanFrame &frame) {
    const uint8_t type = frame.data[0];
    if (type == TO_MODULE(MODULE_IDLE) || type == TO_MODULE(OLD_MODULE_IDLE) ||
        type == TO_MODULE(MODULE_SETUP) || type == TO_MODULE(MODULE_RUN))
        return true;
    if (!is_for_own_program(type)) return false;
    const auto event = transfer_receive(&transfer_, frame.data.data(), frame.dlc);
    counts_.frames_refused += event == TRANSFER_REFUSED;
    if (event != TRANSFER_OWN_PAGE_DONE || transfer_own_pages_missing(&transfer_) > 0) return false;
    report(EventKind::PRINT, "its boot loader has taken " + std::to_string(transfer_.own.pages) +
                                 " pages; it goes on with the program it was built with\n");
    return true;
}

/// To the program.
void Module::hand_over(const CanFrame &frame) {
    const auto &api = *program_->table().module;
    api.can_message->id = frame.id;
    api.can_message->header = static_cast<uint8_t>(frame.dlc << 1);
    std::copy_n(frame.data.begin(), frame.data.size(), api.can_message->data);
    interrupt([&api] { (*api.can_rx)(api.can_message); });
}

CanFrame Module::frame_to_host(uint8_t type) const {
    CanFrame frame;
    frame.id = kilogrid_id({x_, y_, ADDR_DISPATCHER});
    frame.dlc = kilogrid_dlc_to_host(type);
    frame.data[0] = type;
    return frame;
}

// The records are taken out at once; on a module they go one by one, a few milliseconds later.
void Module::answer_poll() {
    const auto &api = *program_->table().module;
    auto &records = *api.records;
    const Cycles pass = state_ == State::IDLE ? BREATH_STEP : AFTER_RECORD;
    poll_pending_ = false;
    CanFrame start = frame_to_host(TO_HOST(TRACKING_KILOBOT_START));
    start.data[1] = records.used;
    queue_answer(start, 0);
    for (uint8_t i = 0; i < records.used; i++) {
        const auto &record = records.slots[(records.first + i) % KT_RECORDS];
        queue_answer(HostCalls::frame_of(record, start.id), i == 0 ? AFTER_START : pass);
    }
    records.first = records.used = 0;
}

void Module::answer_health() {
    const auto &api = *program_->table().module;
    const auto seconds_up = static_cast<uint64_t>(seconds(now_ - power_up_));
    kilogrid_can_to_host_t health{};
    health.type = TO_HOST(MODULE_DATA);
    for (uint8_t part = 0; part < 2; part++) {
        if (!(health_asked_ >> part & 1)) continue;
        health.health_part = part;
        health.state = static_cast<uint8_t>(state_);
        health.config_size = *api.configuration_size;
        health.config_crc = configuration_crc();
        health.lost_records = api.records->lost;
        health.refused_frames = static_cast<uint8_t>(
            std::min<uint64_t>(counts_.frames_refused + counts_.frames_missed, UINT8_MAX));
        health.transmit_errors = tec_;
        health.receive_errors = rec_;
        health.uptime = static_cast<uint16_t>(std::min<uint64_t>(seconds_up, UINT16_MAX));
        health.version = HEALTH_VERSION;
        CanFrame frame = frame_to_host(TO_HOST(MODULE_DATA));
        kilogrid_can_to_host_pack(frame.data.data(), &health, frame.data.size());
        queue_answer(frame, 0);
    }
    health_asked_ = 0;
}

/// Of the configuration that is complete.
uint16_t Module::configuration_crc() const {
    const auto &api = *program_->table().module;
    std::array<uint8_t, KT_CONFIGURATION_BYTES> bytes;
    for (size_t i = 0; i < bytes.size(); i++) bytes[i] = api.configuration[i];
    const bool whole = transfer_.config.next == TRANSFER_NOTHING_DUE;
    const uint8_t size = *api.configuration_size;
    return crc_of(bytes.data(), whole ? size : 0);
}

/// Behind what is queued already, and `gap` after it.
void Module::queue_answer(const CanFrame &frame, Cycles gap) {
    const Cycles last = answers_.empty() ? now_ : std::max(now_, answers_.back().at);
    answers_.push_back({last + gap, frame});
    const auto &api = *program_->table().module;
    interrupt([&api] { (*api.can_tx_success)(); });
}

void Module::emit_answers(Cycles until) {
    auto due = answers_.begin();
    while (due != answers_.end() && due->at < until) can_frames.push_back(*due++);
    answers_.erase(answers_.begin(), due);
}

// Time

// Time passes up to `wake`; interrupts at that moment come before the program goes on.
void Module::wait_until(Cycles wake) {
    const auto &table = program_->table();
    if (table.settle != nullptr) table.settle();
    for (;;) {
        while (!in_interrupt_) {
            const Cycles at = next_interrupt();
            if (at > wake || at >= until_) break;
            serve_interrupt(at);
        }
        if (wake < until_) break;
        wake_ = wake;
        GuestStack::instance().suspend();
    }
    wake_ = NEVER;
    now_ = std::max(now_, wake);
}

void Module::budget_spent(const uint8_t *frame) {
    const auto finding = busy_.look(*program_, frame, GuestStack::instance().top());
    if (finding == BusyWatch::Finding::LOOKING) return;
    const int32_t budget = *program_->table().budget;
    switch (busy_.judge(finding, now_)) {
    case BusyWatch::Verdict::FINE: break;
    case BusyWatch::Verdict::WARN: report(EventKind::BUSY_WAIT, BusyWatch::WARNING); break;
    case BusyWatch::Verdict::ENDLESS:
        stop(EventKind::ENDLESS, BusyWatch::ACCUSATION);
        GuestStack::instance().abandon();
    }
    wait_until(in_interrupt_ ? now_ + TICK_CYCLES : std::max(next_tick_, now_));
    *program_->table().budget = budget;
}

void Module::stop(EventKind kind, std::string text) {
    report(kind, std::move(text));
    life_ = Life::STOPPED;
    asking_ = answered_ = Asking::NOTHING;
    suspended_.clear();
    can_inbox_.clear();
    cell_inbox_.clear();
}

void Module::report(EventKind kind, std::string text) {
    context_.events.push_back({now_, index_, last_tick_, program_->name(), kind, std::move(text)});
}

}  // namespace kilotwin
