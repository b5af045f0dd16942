#include "guest/robot.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace kilotwin {

namespace {

// A basic block takes an AVR about ten cycles, so a program may pass through this many in a tick's time.
constexpr int32_t BLOCKS_PER_TICK = TICK_CYCLES / 10;
// A program that waits needs but one look at what it waits for.
constexpr int32_t BLOCKS_WHILE_WAITING = 500;
constexpr Cycles WARN_AFTER = 10 * CYCLES_PER_SECOND;
constexpr Cycles ENDLESS_AFTER = 60 * CYCLES_PER_SECOND;

constexpr uint16_t TX_PERIOD_AT_RESET = 3906;  // units of 128 us: every 16th tick
constexpr uint16_t TX_CLOCK_PER_TICK = 255;
constexpr uint8_t FIRST_SYSTEM_MESSAGE = 0x80;
constexpr uint32_t RAND_HARD_CYCLES = CYCLES_PER_SECOND / 2000;

Robot *current = nullptr;

uint64_t fnv(uint64_t hash, const uint8_t *begin, const uint8_t *end) {
    for (; begin + 8 <= end; begin += 8) {
        uint64_t word;
        std::memcpy(&word, begin, 8);
        hash = (hash ^ word) * 0x100000001B3u;
        hash ^= hash >> 29;
    }
    for (; begin < end; begin++) hash = (hash ^ *begin) * 0x100000001B3u;
    return hash;
}

}  // namespace

/// Where the guest's calls arrive; all act on the robot that runs.
struct Robot::HostCalls {
    static void init() {
        auto &robot = *current;
        const auto &table = robot.program_->table();
        *table.ticks = robot.last_tick_ = 0;
        *table.tx_period = TX_PERIOD_AT_RESET;
        *table.uid = robot.calibration_.uid;
        *table.turn_left = robot.calibration_.turn_left;
        *table.turn_right = robot.calibration_.turn_right;
        *table.straight_left = robot.calibration_.straight_left;
        *table.straight_right = robot.calibration_.straight_right;
        robot.tx_clock_ = 0;
        robot.next_tick_ = robot.now_ + TICK_CYCLES;
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

    static void set_motors(uint8_t left, uint8_t right) {
        current->left_ = left;
        current->right_ = right;
        current->set_outputs();
    }

    static void set_color(uint8_t rgb) { current->color_ = rgb & 0x3F; }

    static uint8_t rand_hard() {
        auto &robot = *current;
        auto bits = robot.context_.chance.bits(robot.index_, Purpose::RAND_HARD, robot.rand_hard_draws_++);
        wait(RAND_HARD_CYCLES);
        return static_cast<uint8_t>(bits);
    }

    // No light, a full battery, room temperature: as steady as the foot-bots' hall.
    static int16_t sensor(uint8_t which) {
        constexpr int16_t DARK = 0, FULL = 700, ROOM = 300;
        return which == KT_SENSOR_LIGHT ? DARK : which == KT_SENSOR_VOLTAGE ? FULL : ROOM;
    }

    static void print(const char *text, uint32_t bytes) { current->report(EventKind::PRINT, {text, bytes}); }
    static void spent(const uint8_t *frame) { current->budget_spent(frame); }

    // Only interrupts go on: what `for (;;);` means.
    static void empty_loop() {
        auto &robot = *current;
        robot.wait_until(robot.now_ + WARN_AFTER);
        robot.report(EventKind::BUSY_WAIT, "it stays in an empty endless loop");
        for (;;) robot.wait_until(NEVER);
    }

    static void unusable(const char *what) {
        current->stop(EventKind::CRASH, what);
        GuestStack::instance().abandon();
    }
};

const kt_host_t Robot::HOST = {HostCalls::init,      HostCalls::start,     HostCalls::wait,   HostCalls::set_motors,
                               HostCalls::set_color, HostCalls::rand_hard, HostCalls::sensor, HostCalls::print,
                               HostCalls::spent,     HostCalls::unusable};

Robot::Robot(RobotContext &context, std::shared_ptr<Program> program, uint32_t index, Calibration calibration,
             Cycles power_up, uint8_t *image)
    : context_(context),
      program_(std::move(program)),
      image_(image),
      now_(power_up),
      next_tick_(NEVER),
      index_(index),
      calibration_(calibration) {
    std::memcpy(image_, program_->initial_state(), program_->state_bytes());
    *program_->table().host = &HOST;
}

void Robot::serve_this_thread() { GuestStack::instance().serve_this_thread(HostCalls::empty_loop); }

Robot::~Robot() { program_->evict(image_); }

void Robot::receive(const Reception &reception) {
    if (life_ == Life::STOPPED) return;
    auto later = [](const Reception &a, const Reception &b) { return a.at < b.at; };
    if (inbox_.empty() || inbox_.back().at <= reception.at)
        inbox_.push_back(reception);
    else
        inbox_.insert(std::upper_bound(inbox_.begin() + static_cast<ptrdiff_t>(inbox_next_), inbox_.end(),
                                       reception, later),
                      reception);
}

void Robot::run(Cycles until) {
    if (life_ == Life::STOPPED || until <= now_) return;
    if (life_ == Life::ALIVE && suspended_.empty() && !loop_due_ && next_interrupt() >= until) return;
    until_ = until;
    current = this;
    program_->make_resident(image_);
    if (context_.black_box != nullptr) *context_.black_box = {index_, last_tick_};
    auto &stack = GuestStack::instance();
    GuestStack::Outcome outcome;
    do {
        outcome = suspended_.empty() ? stack.call(body, this, suspended_) : stack.resume(suspended_);
    } while (outcome == GuestStack::Outcome::ABANDONED && life_ != Life::STOPPED);
    if (outcome == GuestStack::Outcome::FAULT) {
        const auto &fault = stack.fault();
        char text[96];
        std::snprintf(text, sizeof text, "%s at address %p", strsignal(fault.signal), fault.address);
        if (fault.stack_overflow)
            stop(EventKind::STACK_OVERFLOW, "its stack grew over " + std::to_string(GuestStack::BYTES) + " bytes");
        else if (program_->guards(fault.address))
            stop(EventKind::CRASH, "it wrote or read beyond its own variables");
        else
            stop(EventKind::CRASH, text);
    }
    inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<ptrdiff_t>(inbox_next_));
    inbox_next_ = 0;
    current = nullptr;
}

void Robot::body(void *robot) { static_cast<Robot *>(robot)->live(); }

void Robot::live() {
    *program_->table().budget = BLOCKS_PER_TICK;
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
        } else if (state_ == State::RUNNING && loop_due_) {
            loop_due_ = false;
            Cycles before = now_;
            loop_();
            came_back();
            if (now_ > before) loop_due_ = true;
        } else if (next_interrupt() < until_) {
            serve_interrupt();
        } else {
            return;
        }
    }
}

void Robot::came_back() {
    *program_->table().budget = BLOCKS_PER_TICK;
    busy_since_ = computing_since_ = NEVER;
    warned_ = false;
}

Cycles Robot::next_interrupt() const {
    Cycles message = inbox_next_ < inbox_.size() ? inbox_[inbox_next_].at : NEVER;
    return std::min(message, next_tick_);
}

void Robot::serve_interrupt() {
    if (next_tick_ <= next_interrupt())
        tick();
    else
        take_message();
}

// Runs a callback with interrupts off and a budget of its own. Time that it takes by delay() is lost: one tick stays
// pending, messages are not heard.
template <typename Callback> void Robot::interrupt(Callback callback) {
    in_interrupt_ = true;
    Cycles before = now_;
    int32_t budget = *program_->table().budget;
    *program_->table().budget = BLOCKS_PER_TICK;
    callback();
    *program_->table().budget = budget;
    in_interrupt_ = false;
    if (now_ == before) return;
    while (next_tick_ + TICK_CYCLES <= now_) next_tick_ += TICK_CYCLES;
    while (inbox_next_ < inbox_.size() && inbox_[inbox_next_].at < now_) inbox_next_++;
}

void Robot::tick() {
    now_ = std::max(now_, next_tick_);
    next_tick_ += TICK_CYCLES;
    last_tick_ = *program_->table().ticks + 1;
    *program_->table().ticks = last_tick_;
    loop_due_ = true;
    tx_clock_ = static_cast<uint16_t>(tx_clock_ + TX_CLOCK_PER_TICK);
    if (state_ == State::RUNNING && tx_clock_ > *program_->table().tx_period) interrupt([this] { ask_for_message(); });
}

void Robot::ask_for_message() {
    const auto &table = program_->table();
    const message_t *message = (*table.message_tx)();
    if (message == nullptr) return;
    context_.emissions.push_back({now_, index_, *message});
    tx_clock_ = 0;
    (*table.message_tx_success)();
}

void Robot::take_message() {
    const Reception reception = inbox_[inbox_next_++];
    now_ = std::max(now_, reception.at);
    if (life_ != Life::ALIVE && next_tick_ == NEVER) return;  // not initialised: the receiver is off
    if (reception.message.type >= FIRST_SYSTEM_MESSAGE) return obey(reception.message);
    const auto &table = program_->table();
    *table.rx_message = reception.message;
    *table.rx_distance = reception.distance;
    interrupt([&table] { (*table.message_rx)(table.rx_message, table.rx_distance); });
}

// hardware.md 1.3 and 1.4. The displays of BATTERY, CHARGING and calibration do not concern a profile without them.
void Robot::obey(const message_t &message) {
    if (message.type == RUN) {
        if (state_ == State::SETUP || state_ == State::RUNNING) return;
        state_ = State::SETUP;
        motors_on_ = true;
        left_ = right_ = 0;
        set_outputs();
        return;
    }
    switch_motors_off();
    if (message.type == RESET) reset();
    state_ = message.type == SLEEP ? State::SLEEPING : State::IDLE;
}

void Robot::switch_motors_off() {
    motors_on_ = false;
    left_ = right_ = 0;
    set_outputs();
}

// A jump to address 0 from within the interrupt: memory as after power-up, main() again, the stack forgotten.
void Robot::reset() {
    std::memcpy(program_->table().state_begin, program_->initial_state(), program_->state_bytes());
    life_ = Life::OFF;
    state_ = State::IDLE;
    color_ = 0;
    next_tick_ = NEVER;
    in_interrupt_ = loop_due_ = set_up_ = false;
    came_back();
    GuestStack::instance().abandon();
}

void Robot::set_outputs() {
    MotorCommand command = {now_, motors_on_ ? left_ : uint8_t{0}, motors_on_ ? right_ : uint8_t{0}};
    motor_commands.push_back(command);
}

// Time passes up to `wake`; interrupts at that moment come before the program goes on.
void Robot::wait_until(Cycles wake) {
    for (;;) {
        while (!in_interrupt_ && next_interrupt() <= wake && next_interrupt() < until_) serve_interrupt();
        if (wake < until_) break;
        GuestStack::instance().suspend();
    }
    now_ = std::max(now_, wake);
}

// The program passed through more blocks than fit into a tick without giving time back. If the memory it may count in
// is as it was a tick ago, it waits for something and costs little; else it computes, which must end some day.
void Robot::budget_spent(const uint8_t *frame) {
    if (busy_since_ == NEVER) busy_since_ = now_;
    uint64_t fingerprint = memory_fingerprint(frame);
    bool waits = fingerprint == fingerprint_;
    fingerprint_ = fingerprint;
    if (waits)
        computing_since_ = NEVER;
    else if (computing_since_ == NEVER)
        computing_since_ = now_;
    if (!warned_ && now_ - busy_since_ >= WARN_AFTER) {
        warned_ = true;
        report(EventKind::BUSY_WAIT, "it has been busy for 10 s without coming back or calling delay()");
    }
    if (computing_since_ != NEVER && now_ - computing_since_ >= ENDLESS_AFTER) {
        stop(EventKind::ENDLESS, "it has been computing for 60 s without coming back or calling delay()");
        GuestStack::instance().abandon();
    }
    wait_until(in_interrupt_ ? now_ + TICK_CYCLES : std::max(next_tick_, now_));
    *program_->table().budget = waits ? BLOCKS_WHILE_WAITING : BLOCKS_PER_TICK;
}

/// Over the program's variables but kilo_ticks, and its registers and frames.
uint64_t Robot::memory_fingerprint(const uint8_t *frame) const {
    const auto &table = program_->table();
    auto ticks = reinterpret_cast<const uint8_t *>(const_cast<const uint32_t *>(table.ticks));
    uint64_t hash = fnv(0xCBF29CE484222325u, table.state_begin, ticks);
    hash = fnv(hash, ticks + sizeof *table.ticks, table.state_end);
    return fnv(hash, frame, GuestStack::instance().top());
}

void Robot::stop(EventKind kind, std::string text) {
    report(kind, std::move(text));
    life_ = Life::STOPPED;
    suspended_.clear();
    inbox_.clear();
    inbox_next_ = 0;
}

void Robot::report(EventKind kind, std::string text) {
    context_.events.push_back({now_, index_, last_tick_, program_->name(), kind, std::move(text)});
}

}  // namespace kilotwin
