#include "guest/robot.h"

#include <algorithm>
#include <cstring>

#include "base/memory.h"
#include "guest/fault.h"

namespace kilotwin {

namespace {

constexpr uint16_t TX_PERIOD_AT_RESET = 3906;  // units of 128 us: every 16th tick
constexpr Cycles IDLE_BLINK_ON = CYCLES_PER_SECOND / 1000, IDLE_BLINK_PERIOD = 1'609'600;
constexpr Cycles CHARGE_BLINK_PERIOD = CYCLES_PER_SECOND / 5;
constexpr Cycles SLEEP_PERIOD = 8 * CYCLES_PER_SECOND;    // the watchdog's
constexpr Cycles SLEEP_SETTLE = 2400;                     // 300 us
constexpr Cycles SLEEP_LISTEN = CYCLES_PER_SECOND / 100;  // for the start of a frame
constexpr uint8_t MOTOR_KICK = 255;
constexpr uint32_t MOTOR_KICK_CYCLES = 15 * CYCLES_PER_SECOND / 1000;
// About what an AVR takes from address 0 to main(); it keeps a main() that jumps there from
// standing still in time.
constexpr uint32_t RESTART_CYCLES = CYCLES_PER_SECOND / 1000;
constexpr uint8_t FIRST_SYSTEM_MESSAGE = 0x80;

static_assert(sizeof(Robot) == 8 * sizeof(CacheLine));

Robot *current = nullptr;

}  // namespace

// What the registers now make of motors and LED: hardware.md 1.8.
inline void Robot::look_at_outputs(const volatile kt_outputs_t &outputs, void (*settle)()) {
    if (settle != nullptr) [[unlikely]]
        settle();
    uint64_t seen;
    static_assert(sizeof seen == sizeof outputs);
    std::memcpy(&seen, const_cast<const kt_outputs_t *>(&outputs), sizeof seen);
    if (seen != outputs_seen_) [[unlikely]]
        take_outputs(seen);
}

/// Where the guest's calls arrive; all act on the robot that runs.
struct Robot::HostCalls {
    static void init() {
        auto &robot = *current;
        const auto &table = robot.program_->table();
        *table.ticks = robot.last_tick_ = 0;
        if (table.tx_period != nullptr) *table.tx_period = TX_PERIOD_AT_RESET;
        *table.uid =
            static_cast<uint16_t>(robot.eeprom(EEPROM_UID) | robot.eeprom(EEPROM_UID + 1) << 8);
        *table.turn_left = robot.eeprom(EEPROM_TURN_LEFT);
        *table.turn_right = robot.eeprom(EEPROM_TURN_RIGHT);
        *table.straight_left = robot.eeprom(EEPROM_STRAIGHT_LEFT);
        *table.straight_right = robot.eeprom(EEPROM_STRAIGHT_RIGHT);
        robot.tx_clock_ = 0;
        robot.tick_increment_ = TICK_MATCH;
        robot.next_tick_ = robot.now_ + robot.tick_length_;
        robot.interrupts_off_ = false;
        robot.only_ticks_until_ = 0;
    }

    static void start(void (*setup)(void), void (*loop)(void)) {
        current->setup_ = setup;
        current->loop_ = loop;
        current->life_ = Life::ALIVE;
        GuestStack::instance().abandon();
    }

    static void wait(uint32_t cycles) {
        current->wait_until(current->now_ + cycles);
        current->came_back();
    }

    static void outputs() {
        current->busy_.called();
        current->look_at_outputs();
    }

    static uint8_t rand_hard() {
        auto &robot = *current;
        auto bits =
            robot.context_.chance.bits(robot.index_, Purpose::RAND_HARD, robot.rand_hard_draws_++);
        wait(RAND_HARD_CYCLES);
        return static_cast<uint8_t>(bits);
    }

    static int16_t sensor(uint8_t which) {
        auto &robot = *current;
        robot.busy_.called();
        if (robot.disturbed()) return -1;
        robot.stale_conversion_ = -1;
        if (which == KT_SENSOR_LIGHT) return robot.light;
        if (which == KT_SENSOR_TEMPERATURE) return robot.context_.temperature;
        return robot.stale_conversion_ = robot.voltage(robot.now_);
    }

    static uint8_t distance_mm(int16_t low_gain, int16_t high_gain) {
        if (current->context_.gains_are_mm)
            return static_cast<uint8_t>(std::clamp<int16_t>(high_gain, 0, UINT8_MAX));
        return current->calibration_.gains.estimate_mm({low_gain, high_gain});
    }

    static uint8_t eeprom_read(uint16_t address) { return current->eeprom(address); }
    static void eeprom_write(uint16_t address, uint8_t value) {
        current->set_eeprom(address, value);
    }

    static void interrupts(uint8_t on) {
        auto &robot = *current;
        robot.interrupts_off_ = !on;
        robot.only_ticks_until_ = 0;
        if (on && robot.tick_pending_ && !robot.in_interrupt_) {
            robot.tick_pending_ = false;
            robot.tick();
        }
    }

    static uint8_t timer0() {
        Cycles since = current->now_ + current->tick_length_ -
                       std::min(current->next_tick_, current->now_ + current->tick_length_);
        return static_cast<uint8_t>(std::min<Cycles>(since / COUNT_CYCLES, TICK_MATCH));
    }

    static void print(const char *text, uint32_t bytes) {
        current->busy_.called();
        current->report(EventKind::PRINT, {text, bytes});
    }
    static void spent(const uint8_t *frame) { current->budget_spent(frame); }

    // Only interrupts go on: what `for (;;);` means.
    static void empty_loop() {
        auto &robot = *current;
        robot.wait_until(robot.now_ + BusyWatch::WARN_AFTER);
        robot.report(EventKind::BUSY_WAIT, "it stays in an empty endless loop");
        for (;;) robot.wait_until(NEVER);
    }

    // The fault came from the program, or from libc on its behalf, so that the engine may work as
    // usual here.
    static bool mistake(GuestStack::Mistake mistake, const void *address) {
        auto [noted, text] = explain(mistake, address, *current->program_);
        if (noted == 0) return false;
        current->note(noted, std::move(text));
        return true;
    }

    static void unusable(const char *what) {
        current->stop(EventKind::CRASH, what);
        GuestStack::instance().abandon();
    }
};

const kt_host_t Robot::HOST = {
    HostCalls::init,        HostCalls::start,        HostCalls::wait,
    HostCalls::outputs,     HostCalls::rand_hard,    HostCalls::distance_mm,
    HostCalls::eeprom_read, HostCalls::eeprom_write, HostCalls::interrupts,
    HostCalls::timer0,      HostCalls::sensor,       HostCalls::print,
    HostCalls::spent,       HostCalls::unusable,     nullptr,
};

Robot::Robot(RobotContext &context, Program &program, uint32_t index,
             const Calibration &calibration, Cycles power_up, uint8_t *image)
    : program_(&program),
      image_(image),
      now_(power_up),
      tick_length_(calibration.tick),
      context_(context),
      index_(index),
      outgoing_(),
      state_since_(power_up),
      power_up_(power_up),
      name_(&program.name()),
      calibration_(calibration) {
    std::memcpy(image_, program_->initial_state(), program_->state_bytes());
    *program_->table().host = &HOST;
}

Robot::Robot(RobotContext &context, const std::string &name, uint32_t index,
             const Calibration &calibration, Cycles power_up)
    : now_(power_up),
      tick_length_(calibration.tick),
      context_(context),
      index_(index),
      outgoing_(),
      state_since_(power_up),
      power_up_(power_up),
      name_(&name),
      calibration_(calibration) {}

void Robot::serve_this_thread() { GuestStack::instance().serve_this_thread(); }

Robot::~Robot() {
    if (!on_board()) program_->evict(image_);
}

void Robot::receive(Cycles at, const message_t &message, distance_measurement_t distance) {
    // Most come in order, and after the first one nothing else of the robot has to be looked at.
    if (inbox_.empty()) {
        if (life_ == Life::STOPPED) return;
        next_message_ = at;
    } else if (at < inbox_.back().at) {
        return receive_before_others(at, message, distance);
    }
    inbox_.push_back({at, message, distance});
}

void Robot::receive_before_others(Cycles at, const message_t &message,
                                  distance_measurement_t distance) {
    next_message_ = std::min(next_message_, at);
    auto later = [](Cycles time, const Reception &other) { return time < other.at; };
    const auto place = std::upper_bound(inbox_.begin(), inbox_.end(), at, later);
    inbox_.insert(place, {at, message, distance});
}

void Robot::run(Cycles until) {
    arbitrated_ = false;
    go_on(until);
}

Cycles Robot::run_arbitrated(Cycles until) {
    arbitrated_ = true;
    go_on(until);
    granted_from_ = NEVER;
    return question_ == Question::NONE ? until : now_;
}

void Robot::go_on(Cycles until) {
    if (life_ == Life::STOPPED || on_board() || until <= now_ || question_ != Question::NONE)
        return;
    if (life_ == Life::ALIVE && !is_suspended_ && !loop_due_ && next_interrupt() >= until) return;
    until_ = until;
    current = this;
    program_->make_resident(image_);
    if (context_.black_box != nullptr) *context_.black_box = {index_, last_tick_};
    auto &stack = GuestStack::instance();
    stack.set_handlers(HostCalls::empty_loop, HostCalls::mistake);
    GuestStack::Outcome outcome;
    do {
        outcome = is_suspended_ ? stack.resume(suspended_) : stack.call(body, this, suspended_);
        is_suspended_ = outcome == GuestStack::Outcome::SUSPENDED;
        if (outcome == GuestStack::Outcome::FAULT && stack.fault().jump_to_zero) {
            note(JUMPS_TO_ZERO, "it jumped to address 0, as who calls a NULL pointer does; as on "
                                "the robot, it starts again with main() and waits for RUN");
            start_again();
            now_ += RESTART_CYCLES;
            outcome = GuestStack::Outcome::ABANDONED;
        }
    } while (outcome == GuestStack::Outcome::ABANDONED && life_ != Life::STOPPED && now_ < until_);
    if (outcome == GuestStack::Outcome::FAULT) {
        auto [kind, text] = explain(stack.fault(), *program_);
        stop(kind, std::move(text));
    }
    if (inbox_next_ > 0)
        inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<ptrdiff_t>(inbox_next_));
    inbox_next_ = 0;
    current = nullptr;
}

Cycles Robot::next_ask() const {
    const bool may_run =
        state_ == State::RUNNING || state_ == State::SETUP;  // setup() may end any time
    if (life_ != Life::ALIVE || !may_run || next_tick_ == NEVER) return NEVER;
    const Cycles back = next_tick_ + waits_past_tick_;        // from a callback that waits
    if (program_->table().tx_period != nullptr) return back;  // it may shorten its period any time
    const int missing = TX_PERIOD_AT_RESET - tx_clock_ - tick_increment_;
    if (missing < 0) return back;
    const auto ticks = static_cast<Cycles>(missing / TICK_MATCH + 1);
    return std::max(next_tick_ + ticks * tick_length_, back);
}

inline const volatile uint16_t &Robot::tx_period(const kt_table_t &table) {
    return *(table.tx_period != nullptr ? table.tx_period : &TX_PERIOD_AT_RESET);
}

void Robot::answer(bool yes) {
    answer_ = yes;
    question_ = Question::NONE;
}

void Robot::disturb(Cycles begin, Cycles end) {
    if (on_board()) return;  // it sees for itself
    if (frames_seen_.size() == frames_seen_.capacity()) {
        auto over = [this](const auto &frame) { return frame.second <= now_; };
        frames_seen_.erase(std::remove_if(frames_seen_.begin(), frames_seen_.end(), over),
                           frames_seen_.end());
    }
    frames_seen_.emplace_back(begin, end);
}

bool Robot::disturbed() const {
    return std::any_of(frames_seen_.begin(), frames_seen_.end(),
                       [this](auto &frame) { return frame.first <= now_ && now_ < frame.second; });
}

// Falls evenly with the charge used; a robot that stands uses a tenth of what one needs that
// drives.
int16_t Robot::voltage(Cycles at) const {
    constexpr double FULL = 720, EMPTY = 580, AT_REST = 0.1;
    if (context_.battery == 0) return static_cast<int16_t>(FULL);
    Cycles driven = driven_ + (driving_since_ < at ? at - driving_since_ : 0);
    double age = at > power_up_ ? static_cast<double>(at - power_up_) : 0;
    double used = (static_cast<double>(driven) * (1 - AT_REST) + age * AT_REST) /
                  static_cast<double>(context_.battery);
    return static_cast<int16_t>(std::max(FULL - (FULL - EMPTY) * used, EMPTY));
}

// What the robot shows while its program does not decide: hardware.md 1.3.
uint8_t Robot::color(Cycles at) const {
    constexpr uint8_t GREEN = 3 << 2, BLUE = 3 << 4, YELLOW = 3 | 3 << 2, RED = 3, DIM_RED = 1;
    if (life_ != Life::ALIVE || on_board()) return color_;  // before kilo_start() and after its end
    Cycles in_state = at > state_since_ ? at - state_since_ : 0;
    switch (state_) {
    case State::IDLE: return in_state % IDLE_BLINK_PERIOD < IDLE_BLINK_ON ? GREEN : 0;
    case State::CHARGING: return in_state % CHARGE_BLINK_PERIOD < IDLE_BLINK_ON ? DIM_RED : 0;
    case State::BATTERY:
        return voltage(at) > 682   ? GREEN
               : voltage(at) > 648 ? BLUE
               : voltage(at) > 614 ? YELLOW
                                   : RED;
    case State::SLEEPING: return 0;
    default: return color_;
    }
}

uint8_t Robot::eeprom(uint16_t address) const {
    address %= EEPROM_BYTES;
    return eeprom_ ? (*eeprom_)[address] : calibrated_byte(calibration_, address);
}

void Robot::set_eeprom(uint16_t address, uint8_t value) {
    if (!eeprom_) eeprom_ = std::make_unique<EepromImage>(eeprom_of(calibration_));
    (*eeprom_)[address % EEPROM_BYTES] = value;
}

void Robot::body(void *robot) { static_cast<Robot *>(robot)->live(); }

void Robot::live() {
    *program_->table().budget = TURNS_PER_TICK;
    if (life_ == Life::OFF) {
        life_ = Life::BOOTING;
        program_->table().program_main();
        stop(EventKind::CRASH, "main() came back: it never called kilo_start()");
        return;
    }
    for (;;) {
        if (state_ == State::SETUP) {
            if (!set_up_) setup_();
            set_up_ = true;
            if (state_ == State::SETUP) state_ = State::RUNNING;
            loop_due_ = true;
            came_back();
        } else if (state_ == State::RUNNING && (loop_due_ || plain_tick_before(quiet_until()))) {
            run_loop();
        } else if (next_interrupt() < until_) {
            serve_interrupt();
        } else {
            return;
        }
    }
}

// Calls loop() if it is due, and again at each tick and after each message. Most calls do nothing,
// so that what goes on between them counts: it lies in one row, with what is rare out of the way.
void Robot::run_loop() {
    const auto &table = program_->table();
    auto &ticks = *table.ticks;
    auto &budget = *table.budget;
    const auto &outputs = *table.outputs;
    const auto settle = table.settle;
    const auto &tx_period = Robot::tx_period(table);
    Cycles until = quiet_until(), before = now_;
    only_ticks_until_ = only_ticks_until(until);
    auto call = [&] {
        before = now_;
        loop_();
        busy_.came_back(budget);
        look_at_outputs(outputs, settle);
    };
    if (std::exchange(loop_due_, false)) call();
    for (;;) {
        Cycles at = next_tick_;
        if (at >= only_ticks_until_) [[unlikely]] {
            if (now_ > before) loop_due_ = true;
            if (loop_due_) return;
            if (!plain_tick_before(until)) {
                if (!message_comes_next()) return;
                take_message();
                if (!loop_due_ || state_ != State::RUNNING) return;
                loop_due_ = false;
                until = quiet_until();
                only_ticks_until_ = only_ticks_until(until);
                call();
                continue;
            }
            at = std::max(at, now_);
            only_ticks_until_ = only_ticks_until(until);
        }
        now_ = at;
        next_tick_ += tick_length_;
        count_tick(ticks, TICK_MATCH);
        if (tx_clock_ > tx_period) [[unlikely]] {
            before = now_;
            interrupt(table, [this, &table] { ask_for_message(table); });
            if (arbitrated_) until = quiet_until();
            only_ticks_until_ = only_ticks_until(until);
            if (now_ != before || tick_increment_ != TICK_MATCH) {
                loop_due_ = true;
                return;
            }
        }
        call();
    }
}

void Robot::came_back() { busy_.came_back(*program_->table().budget); }

void Robot::serve_interrupt() {
    if (next_message_ < next_tick_)
        take_message();
    else if (interrupts_off_) {
        now_ = std::max(now_, next_tick_);
        next_tick_ += tick_length_;
        tick_pending_ = loop_due_ = true;
    } else {
        now_ = std::max(now_, next_tick_);
        next_tick_ = tick_increment_ == TICK_MATCH ? next_tick_ + tick_length_ : overflow_;
        tick();
    }
}

// Runs a callback with interrupts off and a budget of its own. Time that it takes by delay() is
// lost: one tick stays pending, messages are not heard.
template <typename Callback>
inline void Robot::interrupt(const kt_table_t &table, Callback callback) {
    in_interrupt_ = true;
    const Cycles before = now_;
    int32_t &left = *table.budget;
    const int32_t budget = left;
    left = TURNS_PER_TICK;
    callback();
    left = budget;
    in_interrupt_ = interrupts_off_ = false;
    look_at_outputs(*table.outputs, table.settle);
    if (now_ == before) return;
    while (next_tick_ + tick_length_ <= now_) next_tick_ += tick_length_;
    while (inbox_next_ < inbox_.size() && inbox_[inbox_next_].at < now_) inbox_next_++;
    inbox_changed();
}

inline void Robot::count_tick(volatile uint32_t &ticks, uint16_t counts) {
    ticks = last_tick_ = ticks + 1;
    tx_clock_ = static_cast<uint16_t>(tx_clock_ + counts);
}

void Robot::tick() {
    const auto &table = program_->table();
    count_tick(*table.ticks, std::exchange(tick_increment_, TICK_MATCH));
    loop_due_ = true;
    if (state_ == State::RUNNING && tx_clock_ > tx_period(table))
        interrupt(table, [this, &table] { ask_for_message(table); });
}

inline void Robot::ask_for_message(const kt_table_t &table) {
    const bool granted = !arbitrated_ || (granted_from_ <= now_ && now_ <= granted_to_);
    if (!granted && !ask_medium(Question::MAY_ASK)) return;
    if (const message_t *message = (*table.message_tx)()) send(*message, granted);
}

void Robot::send(const message_t &message, bool granted) {
    if (granted) {
        context_.emissions.push_back({now_, index_, message});
        if (arbitrated_) until_ = std::max(until_, granted_until_);
    } else {
        outgoing_ = message;
        if (!ask_medium(Question::IS_CHANNEL_FREE)) return retry_soon();
    }
    if (context_.frame > 0) wait_until(now_ + context_.frame);
    tx_clock_ = 0;
    (*program_->table().message_tx_success)();
}

bool Robot::ask_medium(Question question) {
    question_ = question;
    GuestStack::instance().suspend();
    return answer_;
}
// The failed attempt moves timer 0's compare value somewhere else, by libc's rand(): the next match
// comes soon, counts as a tick and tries again (hardware.md 1.6).
void Robot::retry_soon() {
    now_ += SENSE_CYCLES;
    Cycles overflow = next_tick_;  // the next time that the timer is at 0
    tick_increment_ = static_cast<uint16_t>((*program_->table().random)() & TICK_MATCH);
    Cycles match = overflow - (TICK_MATCH - tick_increment_) * COUNT_CYCLES;
    if (match <= now_) {
        match += tick_length_;
        overflow += tick_length_;
    }
    next_tick_ = match;
    overflow_ = overflow;
}

void Robot::take_message() {
    const Reception reception = inbox_[inbox_next_++];
    inbox_changed();
    now_ = std::max(now_, reception.at);
    if (next_tick_ == NEVER && state_ != State::SLEEPING)
        return;  // not initialised: the receiver is off
    if (interrupts_off_ || (state_ == State::SLEEPING && !wakes_for(reception.at - FRAME_CYCLES)))
        return;
    if (reception.message.type >= FIRST_SYSTEM_MESSAGE) return obey(reception.message);
    const auto &table = program_->table();
    *table.rx_message = reception.message;
    *table.rx_distance = reception.distance;
    if (stale_conversion_ >= 0) table.rx_distance->high_gain = stale_conversion_;
    stale_conversion_ = -1;
    interrupt(table, [&table] { (*table.message_rx)(table.rx_message, table.rx_distance); });
    loop_due_ = true;  // it sees at once what the callback changed
}

// hardware.md 1.3 and 1.4.
void Robot::obey(const message_t &message) {
    switch (message.type) {
    case RUN:
        if (state_ == State::SETUP || state_ == State::RUNNING) return;
        enter(State::SETUP);
        switch_motors(true);
        return;
    case READUID: {
        bool set = calibration_.uid >> (message.data[0] & 15) & 1;
        return move_for_display(set ? *program_->table().turn_left : uint8_t{0}, 0);
    }
    case CALIB: return calibrate(message);
    default: break;
    }
    switch_motors(false);
    switch (message.type) {
    case RESET: start_again(); GuestStack::instance().abandon();
    case SLEEP: return fall_asleep();
    case CHARGE: return enter(State::CHARGING);
    case VOLTAGE: return enter(State::BATTERY);
    default: return enter(State::IDLE);
    }
}

// CALIB: mode; uid; turn left, turn right; straight left, straight right. SAVE counts only after a
// trial.
void Robot::calibrate(const message_t &message) {
    enum { SAVE, UID, TURN_LEFT, TURN_RIGHT, STRAIGHT };
    const uint8_t *data = message.data;
    switch (data[0]) {
    case SAVE: {
        if (state_ != State::MOVING) return;
        constexpr uint16_t WHERE[] = {EEPROM_UID,           EEPROM_UID + 1,
                                      EEPROM_TURN_LEFT,     EEPROM_TURN_RIGHT,
                                      EEPROM_STRAIGHT_LEFT, EEPROM_STRAIGHT_RIGHT};
        for (size_t i = 0; i < std::size(WHERE); i++) set_eeprom(WHERE[i], data[1 + i]);
        calibration_.uid = static_cast<uint16_t>(data[1] | data[2] << 8);
        switch_motors(false);
        return enter(State::IDLE);
    }
    case UID: return move_for_display(0, 0);
    case TURN_LEFT: return move_for_display(data[3], 0);
    case TURN_RIGHT: return move_for_display(0, data[4]);
    case STRAIGHT: return move_for_display(data[5], data[6]);
    default: return;
    }
}

// MOVING: the motors concerned are kicked, then turn as told until the next command.
void Robot::move_for_display(uint8_t left, uint8_t right) {
    enter(State::MOVING);
    auto &outputs = *program_->table().outputs;
    outputs.ddrb = outputs.ddrb | KT_LEFT_MOTOR_DDRB;
    outputs.ddrd = outputs.ddrd | KT_RIGHT_MOTOR_DDRD;
    auto drive = [&](uint8_t l, uint8_t r) {
        outputs.ocr2a = l;
        outputs.ocr2b = r;
        look_at_outputs();
    };
    drive(left != 0 ? MOTOR_KICK : 0, right != 0 ? MOTOR_KICK : 0);
    in_interrupt_ = true;
    wait_until(now_ + MOTOR_KICK_CYCLES);
    in_interrupt_ = false;
    drive(left, right);
}

void Robot::enter(State state) {
    state_ = state;
    state_since_ = now_;
    if (state == State::SETUP) return;
    auto &outputs = *program_->table().outputs;  // these states use the LED for themselves
    outputs.ddrc = outputs.ddrc & ~0x3C;
    outputs.ddrd = outputs.ddrd & ~0x30;
    look_at_outputs();
}

// Power-down: the timer stands still, and the receiver is off but for a moment each time the
// watchdog wakes it.
void Robot::fall_asleep() {
    enter(State::SLEEPING);
    next_tick_ = NEVER;
    loop_due_ = false;
}

/// Whether a sleeping robot hears a frame that begins at `at`; if so it is awake.
bool Robot::wakes_for(Cycles at) {
    Cycles in_period = (at - state_since_) % SLEEP_PERIOD;
    if (at < state_since_ + SLEEP_PERIOD || in_period < SLEEP_SETTLE ||
        in_period >= SLEEP_SETTLE + SLEEP_LISTEN)
        return false;
    next_tick_ = now_ + tick_length_;
    return true;
}

void Robot::switch_motors(bool on) {
    auto &outputs = *program_->table().outputs;
    outputs.ocr2a = 0;
    outputs.ocr2b = 0;
    outputs.ddrb = on ? outputs.ddrb | KT_LEFT_MOTOR_DDRB : outputs.ddrb & ~KT_LEFT_MOTOR_DDRB;
    outputs.ddrd = on ? outputs.ddrd | KT_RIGHT_MOTOR_DDRD : outputs.ddrd & ~KT_RIGHT_MOTOR_DDRD;
    look_at_outputs();
}

// A jump to address 0: memory as after power-up, main() again, the stack forgotten.
void Robot::start_again() {
    std::memcpy(program_->table().state_begin, program_->initial_state(), program_->state_bytes());
    life_ = Life::OFF;
    enter(State::IDLE);
    next_tick_ = NEVER;
    in_interrupt_ = interrupts_off_ = tick_pending_ = loop_due_ = set_up_ = false;
    came_back();
}

void Robot::look_at_outputs() {
    look_at_outputs(*program_->table().outputs, program_->table().settle);
}

void Robot::take_outputs(uint64_t seen) {
    outputs_seen_ = seen;
    kt_outputs_t registers;
    std::memcpy(&registers, &seen, sizeof registers);
    auto lit = [](uint8_t ddr, uint8_t port, int pin) { return ddr >> pin & ~(port >> pin) & 1; };
    color_ = static_cast<uint8_t>(lit(registers.ddrd, registers.portd, 5) |
                                  lit(registers.ddrd, registers.portd, 4) << 1 |
                                  lit(registers.ddrc, registers.portc, 3) << 2 |
                                  lit(registers.ddrc, registers.portc, 2) << 3 |
                                  lit(registers.ddrc, registers.portc, 5) << 4 |
                                  lit(registers.ddrc, registers.portc, 4) << 5);
    uint8_t left = registers.ddrb & KT_LEFT_MOTOR_DDRB ? registers.ocr2a : 0;
    uint8_t right = registers.ddrd & KT_RIGHT_MOTOR_DDRD ? registers.ocr2b : 0;
    drive({now_, left, right});
}

void Robot::drive(const MotorCommand &command) {
    if (command.left == left_ && command.right == right_) return;
    left_ = command.left;
    right_ = command.right;
    if (driving_since_ != NEVER) driven_ += command.at - driving_since_;
    driving_since_ = left_ != 0 || right_ != 0 ? command.at : NEVER;
    motor_commands.push_back(command);
}

// Time passes up to `wake`; interrupts at that moment come before the program goes on.
void Robot::wait_until(Cycles wake) {
    only_ticks_until_ = 0;
    look_at_outputs();
    for (;;) {
        while (!in_interrupt_ && next_interrupt() <= wake && next_interrupt() < until_)
            serve_interrupt();
        if (wake < until_) break;
        if (in_interrupt_ && wake > next_tick_)
            waits_past_tick_ = static_cast<uint32_t>(wake - next_tick_);
        GuestStack::instance().suspend();
        waits_past_tick_ = 0;
    }
    now_ = std::max(now_, wake);
}

// The program took more turns than fit into a tick without giving time back. Nothing
// happens around it while it is looked at; then time passes.
void Robot::budget_spent(const uint8_t *frame) {
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

void Robot::stop(EventKind kind, std::string text) {
    report(kind, std::move(text));
    life_ = Life::STOPPED;
    if (left_ != 0 || right_ != 0) motor_commands.push_back({now_, 0, 0});
    left_ = right_ = 0;
    suspended_.clear();
    inbox_.clear();
    inbox_next_ = 0;
    inbox_changed();
}

void Robot::print(Cycles at, uint32_t tick, std::string text) {
    now_ = at;
    last_tick_ = tick;
    report(EventKind::PRINT, std::move(text));
}

void Robot::crash(Cycles at, uint32_t tick, std::string text) {
    now_ = at;
    last_tick_ = tick;
    stop(EventKind::CRASH, std::move(text));
}

void Robot::note(uint8_t mistake, std::string text) {
    if (noted_ & mistake) return;
    noted_ |= mistake;
    report(EventKind::NOTE, std::move(text));
}

void Robot::report(EventKind kind, std::string text) {
    context_.events.push_back({now_, index_, last_tick_, *name_, kind, std::move(text)});
}

}  // namespace kilotwin
