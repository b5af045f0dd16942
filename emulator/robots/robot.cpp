#include "robots/robot.h"

#include <algorithm>
#include <cstring>

#include "kilolib/core/sleep_rhythm.h"
#include "kilolib/core/traits.h"
#include "robots/native/fault.h"

namespace kilotwin {

namespace {

// In place of kilo_tx_period: no count exceeds it.
constexpr uint16_t NEVER_ASKED = UINT16_MAX;
static_assert(sizeof(Robot) == 8 * sizeof(CacheLine));

}  // namespace

Robot::Robot(RobotContext &context, Program &program, uint32_t index,
             const Calibration &calibration, Cycles power_up, uint8_t *image)
    : RobotRecord(context, &program, image, index, program.name(), calibration, power_up) {
    std::memcpy(image_, program_->initial_state(), program_->state_bytes());
    if (program_->translation() == nullptr) *program_->table().host = &HOST;
}

Robot::Robot(RobotContext &context, const std::string &name, uint32_t index,
             const Calibration &calibration, Cycles power_up)
    : RobotRecord(context, nullptr, nullptr, index, name, calibration, power_up) {}

void Robot::serve_this_thread() { GuestStack::instance().serve_this_thread(); }

Robot::~Robot() {
    GuestStack::instance().forget(&now_);
    if (!on_board()) program_->evict(image_);
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
    if (program_->translation() != nullptr) {
        until_ = until;
        return go_on_translated();
    }
    if (life_ == Life::ALIVE && !is_suspended_ && !loop_due_ && next_interrupt() >= until) return;
    until_ = until;
    running = this;
    program_->make_resident(image_);
    if (context_->black_box != nullptr) context_->black_box->runs(index_, last_tick_);
    attend_faults();
    auto &stack = GuestStack::instance();
    GuestStack::Outcome outcome;
    do {
        outcome = is_suspended_ ? stack.resume(suspended_) : stack.call(body, this, suspended_);
        is_suspended_ = outcome == GuestStack::Outcome::SUSPENDED;
        if (outcome == GuestStack::Outcome::FAULT && stack.fault().jump_to_zero) {
            restart_from_zero(stack.fault().place.path());
            outcome = GuestStack::Outcome::ABANDONED;
        }
    } while (outcome == GuestStack::Outcome::ABANDONED && life_ != Life::STOPPED && now_ < until_);
    if (outcome == GuestStack::Outcome::FAULT) {
        auto [kind, text, code] = explain(stack.fault(), *program_);
        stop(kind, std::move(text), std::move(code));
    }
    if (inbox_next_ > 0)
        inbox_.erase(inbox_.begin(), inbox_.begin() + static_cast<ptrdiff_t>(inbox_next_));
    inbox_next_ = 0;
    running = nullptr;
}

// A callback that waits comes back later. A translated program takes a message where a block of
// its code has ended: it may be an order to run. An interrupt of it that is not over may yet put
// the next one forward: one that has found the channel busy draws when it tries again.
Cycles Robot::next_ask() const {
    if (life_ != Life::ALIVE || next_tick_ == NEVER) return NEVER;
    if (program_->translation() != nullptr && (in_interrupt_ || next_message_ <= now_)) [[unlikely]]
        return now_;
    return std::max(std::min(next_request(), next_answer()), next_tick_ + waits_past_tick_);
}

// setup() may end any time, and a program that does not settle its period may shorten it any time.
Cycles Robot::next_request() const {
    if (core_.state != ROBOT_RUNNING && core_.state != ROBOT_SETUP) return NEVER;
    if (!program_->may_send()) return NEVER;
    if (program_->names_period() && (core_.state == ROBOT_SETUP || !program_->settles_period()))
        return next_tick_;
    return transmit_clock_next_request(&core_.transmit, period_, next_matches(), tick_length_);
}

Cycles Robot::next_answer() const {
    const uint16_t matches = robot_answer_matches(&core_.answer);
    return matches == 0 ? NEVER : timer_match(matches, next_matches(), tick_length_);
}

timer_matches_t Robot::next_matches() const {
    return {next_tick_, ticks_are_ordinary() ? next_tick_ + tick_length_ : overflow_};
}

inline const volatile uint16_t &Robot::tx_period(const kt_table_t &table) const {
    if (table.message_tx == nullptr) return NEVER_ASKED;
    if (table.tx_period == nullptr || program_->settles_period()) return period_;
    return *table.tx_period;
}

void Robot::answer(bool yes) {
    answer_ = yes;
    question_ = Question::NONE;
}

void Robot::body(void *robot) { static_cast<Robot *>(robot)->live(); }

void Robot::live() {
    *program_->table().budget = TURNS_PER_TICK;
    program_->turns_held_back = 0;
    if (life_ == Life::OFF) {
        life_ = Life::BOOTING;
        program_->table().program_main();
        stop(EventKind::CRASH, "main() came back: it never called kilo_start()");
        return;
    }
    for (;;) {
        const bool acts =
            core_.state == ROBOT_SETUP || (core_.state == ROBOT_MOVING && core_.motion_is_new);
        if (acts && acts_at_ < until_ && acts_at_ <= next_interrupt()) {
            now_ = std::max(now_, acts_at_);
            if (core_.state == ROBOT_SETUP)
                set_up();
            else
                start_motion();
        } else if (core_.state == ROBOT_RUNNING &&
                   (loop_due_ || plain_tick_before(quiet_until()))) {
            run_loop();
        } else if (next_interrupt() < until_) {
            serve_interrupt();
        } else {
            return;
        }
    }
}

void Robot::set_up() {
    if (robot_begins_setup(&core_)) setup_();
    if (program_->settles_period()) period_ = *program_->table().tx_period;
    robot_end_setup(&core_);
    loop_due_ = true;
    came_back();
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
        busy_.came_back(*program_, budget);
        look_at_outputs(outputs, settle);
    };
    if (loop_due_) {
        loop_due_ = false;
        call();
    }
    for (;;) {
        Cycles at = next_tick_;
        if (at >= only_ticks_until_) [[unlikely]] {
            if (now_ > before) loop_due_ = true;
            if (loop_due_) return;
            if (!plain_tick_before(until)) {
                if (!message_comes_next()) return;
                take_message();
                if (!loop_due_ || core_.state != ROBOT_RUNNING) return;
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
        count_tick(ticks);
        if (transmit_clock_is_due(&core_.transmit, tx_period)) [[unlikely]] {
            before = now_;
            interrupt(table, [this, &table] { ask_for_message(table); });
            if (arbitrated_) until = quiet_until();
            only_ticks_until_ = only_ticks_until(until);
            if (now_ != before || !ticks_are_ordinary()) {
                loop_due_ = true;
                return;
            }
        }
        call();
    }
}

void Robot::came_back() { busy_.came_back(*program_, *program_->table().budget); }

void Robot::serve_interrupt() {
    if (next_message_ < next_tick_)
        take_message();
    else if (interrupts_off_) {
        now_ = std::max(now_, next_tick_);
        next_tick_ += tick_length_;
        tick_pending_ = loop_due_ = true;
    } else {
        now_ = std::max(now_, next_tick_);
        next_tick_ = ticks_are_ordinary() ? next_tick_ + tick_length_ : overflow_;
        tick();
    }
}

// Runs a callback with interrupts off and a budget of its own. Time that it takes by delay() is
// lost: one tick stays pending, messages are not received.
template <typename Callback>
inline void Robot::interrupt(const kt_table_t &table, Callback callback) {
    in_interrupt_ = true;
    const Cycles before = now_;
    int32_t &left = *table.budget;
    const int32_t budget = left, held_back = std::exchange(program_->turns_held_back, 0);
    left = TURNS_PER_TICK;
    callback();
    left = budget;
    program_->turns_held_back = held_back;
    in_interrupt_ = interrupts_off_ = false;
    look_at_outputs(*table.outputs, table.settle);
    if (now_ == before) return;
    while (next_tick_ != NEVER && next_tick_ + tick_length_ <= now_) next_tick_ += tick_length_;
    while (inbox_next_ < inbox_.size() && inbox_[inbox_next_].at < now_) inbox_next_++;
    inbox_changed();
}

inline void Robot::count_tick(volatile uint32_t &ticks) {
    ticks = last_tick_ = ticks + 1;
    transmit_clock_match(&core_.transmit);
}

void Robot::tick() {
    const auto &table = program_->table();
    count_tick(*table.ticks);
    loop_due_ = true;
    if (robot_answer_is_due(&core_.answer))
        interrupt(table, [this, &table] { try_to_answer(table); });
    else if (core_.state == ROBOT_RUNNING &&
             transmit_clock_is_due(&core_.transmit, tx_period(table)))
        interrupt(table, [this, &table] { ask_for_message(table); });
}

inline bool Robot::may_be_asked() { return in_the_dark_ || ask_medium(Question::MAY_ASK); }

inline void Robot::ask_for_message(const kt_table_t &table) {
    const bool granted = may_send();
    if (!granted && !may_be_asked()) return;
    const message_t *message = (*table.message_tx)();
    nulls_ = message != nullptr ? 0 : std::min(nulls_ + 1, NULLS_TO_BE_QUIET);
    if (message == nullptr) return;
    if (!put_on_air(*message, granted)) return retry_soon();
    transmit_clock_sent(&core_.transmit);
    (*table.message_tx_success)();
}

// The runtime's own frame: the program's transmit clock goes on as if there were none.
void Robot::try_to_answer(const kt_table_t &table) {
    const bool granted = may_send();
    if (!granted && !may_be_asked()) return;
    const robot_heard_t heard = rare_ ? rare_->heard : robot_heard_t{};
    uint8_t content[REPORT_CONTENT];
    if (core_.answer.first == ROBOT_QUERY_VITALS)
        robot_answer_vitals(&heard, voltage(now_), content);
    else
        gains_saved(core_.answer.first, content);
    message_t answer;
    robot_answer_fill(&core_.answer, &answer, *table.uid, core_.state, content);
    if (put_on_air(answer, granted)) robot_answer_end(&core_.answer);
}

bool Robot::put_on_air(const message_t &message, bool granted) {
    if (granted) {
        Emission &emission = context_->emissions.emplace_back();  // filled where it stands
        emission.at = now_;
        emission.robot = index_;
        emission.message = message;
        if (arbitrated_) until_ = std::max(until_, granted_until_);
    } else {
        outgoing_ = message;
        if (!ask_medium(Question::IS_CHANNEL_FREE)) {
            now_ += SENSE_CYCLES;
            return false;
        }
    }
    if (context_->frame > 0) wait_until(now_ + context_->frame);
    return true;
}

/// Leaves the program; other robots run meanwhile, by the same budget.
void Robot::suspend() {
    int32_t &left = *program_->table().budget;
    const int32_t budget = left, held_back = program_->turns_held_back;
    GuestStack::instance().suspend();
    left = budget;
    program_->turns_held_back = held_back;
}

bool Robot::ask_medium(Question question) {
    question_ = question;
    suspend();
    return answer_;
}

// The next match comes soon, counts as a tick and tries again (hardware.md 1.6).
void Robot::retry_soon() {
    const uint8_t compare = transmit_clock_retry(&core_.transmit, (*program_->table().random)());
    const auto next = timer_matches_after_retry(now_, next_tick_, compare, tick_length_);
    next_tick_ = next.match;
    overflow_ = next.ordinary;
}

void Robot::take_message() {
    const Reception reception = inbox_[inbox_next_++];
    inbox_changed();
    now_ = std::max(now_, reception.at);
    if (!receives(reception)) return;
    if (message_is_command(&reception.message)) {
        message_t command = reception.message;
        if (program_->table().original != 0 && !original_knows(&command)) return;
        if (robot_answer_is_heard(&reception.message))
            robot_answer_hear(&written().heard, &reception.message, &reception.distance);
        return obey(command);
    }
    const auto &table = program_->table();
    *table.rx_message = reception.message;
    *table.rx_distance = reception.distance;
    if (stale_conversion_ >= 0) table.rx_distance->high_gain = stale_conversion_;
    stale_conversion_ = -1;
    interrupt(table, [&table] { (*table.message_rx)(table.rx_message, table.rx_distance); });
    loop_due_ = true;  // it sees at once what the callback changed
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
        suspend();
        waits_past_tick_ = 0;
    }
    now_ = std::max(now_, wake);
}

}  // namespace kilotwin
