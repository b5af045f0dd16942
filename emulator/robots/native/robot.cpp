#include "robots/native/robot.h"

#include <algorithm>
#include <utility>

#include "kilolib/core/robot_query.h"
#include "kilolib/core/traits.h"

namespace kilotwin {

namespace {

// In place of kilo_tx_period: no count exceeds it.
constexpr uint16_t NEVER_ASKED = UINT16_MAX;

}  // namespace

NativeRobot::NativeRobot(Program &program, RobotRecord &robot, uint8_t *image)
    : NativeGuest(program, robot, image),
      robot_(robot) {
    state_since_ = robot.power_up;
}

void NativeRobot::run() {
    using Life = RobotRecord::Life;
    if (robot_.life == Life::ALIVE && !is_suspended_ && !loop_due_ &&
        robot_.next_interrupt() >= robot_.until)
        return;
    BlackBox::Share *box = robot_.context->black_box;
    if (box != nullptr) box->runs(robot_.index, robot_.last_tick);
    execute();
    robot_.forget_taken();
}

// A callback that waits comes back later.
Cycles NativeRobot::next_ask() const {
    if (robot_.life != RobotRecord::Life::ALIVE || robot_.next_tick == NEVER) return NEVER;
    return std::max(std::min(next_request(), robot_.next_answer()),
                    robot_.next_tick + robot_.waits_past_tick);
}

void NativeRobot::keep(Kept &kept) const {
    kept.guest = *this;
    kept.robot = *this;
    kept.variables.resize(program_->state_bytes());
    program_->copy_state_of(image_, kept.variables.data());
}

void NativeRobot::restore(const Kept &kept) {
    stack().forget(&robot_.now);
    static_cast<GuestState &>(*this) = kept.guest;
    static_cast<NativeRobotState &>(*this) = kept.robot;
    program_->set_state_of(image_, kept.variables.data());
}

/// setup() may choose any period, and a program that does not settle it may shorten it any time.
/// One whose setup() has yet to begin, or waits, is asked for nothing before that goes on.
Cycles NativeRobot::next_request() const {
    const bool is_set_up = robot_.core.state == ROBOT_RUNNING;
    if ((!is_set_up && robot_.core.state != ROBOT_SETUP) || !program_->may_send()) return NEVER;
    const bool is_settled = !program_->names_period() || (is_set_up && program_->settles_period());
    const Cycles soonest = is_settled ? robot_.next_request(period_) : robot_.next_tick;
    return is_set_up ? soonest : std::max(acts_at_, soonest);
}

inline const volatile uint16_t &NativeRobot::tx_period(const kt_table_t &table) const {
    if (table.message_tx == nullptr) return NEVER_ASKED;
    if (table.tx_period == nullptr || program_->settles_period()) return period_;
    return *table.tx_period;
}

void NativeRobot::live() {
    *table().budget = TURNS_PER_TICK;
    program_->turns_held_back = 0;
    if (robot_.life == RobotRecord::Life::OFF) {
        robot_.life = RobotRecord::Life::BOOTING;
        table().program_main();
        stop(EventKind::CRASH, "main() came back: it never called kilo_start()");
        return;
    }
    for (;;) {
        const bool acts = robot_.core.state == ROBOT_SETUP ||
                          (robot_.core.state == ROBOT_MOVING && robot_.core.motion_is_new);
        if (acts && acts_at_ < robot_.until && acts_at_ <= robot_.next_interrupt()) {
            robot_.now = std::max(robot_.now, acts_at_);
            if (robot_.core.state == ROBOT_SETUP)
                set_up();
            else
                start_motion();
        } else if (robot_.core.state == ROBOT_RUNNING &&
                   (loop_due_ || plain_tick_before(quiet_until()))) {
            run_loop();
        } else if (robot_.next_interrupt() < robot_.until) {
            serve_interrupt();
        } else {
            return;
        }
    }
}

void NativeRobot::count_on(uint32_t ticks) {
    program_->make_resident(image_);
    robot_.last_tick += ticks;
    *table().ticks = robot_.last_tick;
}

void NativeRobot::set_up() {
    if (robot_begins_setup(&robot_.core)) setup_();
    if (program_->settles_period()) period_ = *table().tx_period;
    robot_end_setup(&robot_.core);
    loop_due_ = true;
    came_back();
}

// Calls loop() if it is due, and again at each tick and after each message. Most calls do nothing,
// so that what goes on between them counts: it lies in one row, with what is rare out of the way.
void NativeRobot::run_loop() {
    RobotRecord &robot = robot_;  // the program is not known to leave the reference alone
    const auto &table = program_->table();
    auto &ticks = *table.ticks;
    auto &budget = *table.budget;
    const auto &outputs = *table.outputs;
    const auto settle = table.settle;
    const auto &tx_period = NativeRobot::tx_period(table);
    Cycles until = quiet_until(), before = robot.now;
    robot.only_ticks_until = only_ticks_until(until);
    auto call = [&] {
        before = robot.now;
        loop_();
        busy_.came_back(*program_, budget);
        look_at_outputs(outputs, settle);
    };
    if (loop_due_) {
        loop_due_ = false;
        call();
    }
    for (;;) {
        Cycles at = robot.next_tick;
        if (at >= robot.only_ticks_until) [[unlikely]] {
            if (robot.now > before) loop_due_ = true;
            if (loop_due_) return;
            if (!plain_tick_before(until)) {
                if (!message_comes_next()) return;
                take_message();
                if (!loop_due_ || robot.core.state != ROBOT_RUNNING) return;
                loop_due_ = false;
                until = quiet_until();
                robot.only_ticks_until = only_ticks_until(until);
                call();
                continue;
            }
            at = std::max(at, robot.now);
            robot.only_ticks_until = only_ticks_until(until);
        }
        robot.now = at;
        robot.next_tick += robot.tick_length;
        ticks = robot.last_tick = ticks + 1;
        transmit_clock_match(&robot.core.transmit);
        if (transmit_clock_is_due(&robot.core.transmit, tx_period)) [[unlikely]] {
            before = robot.now;
            interrupt(table, [this, &table] { ask_for_message(table); });
            if (robot.arbitrated) until = quiet_until();
            robot.only_ticks_until = only_ticks_until(until);
            if (robot.now != before || !robot.ticks_are_ordinary()) {
                loop_due_ = true;
                return;
            }
        }
        call();
    }
}

void NativeRobot::serve_interrupt() {
    if (robot_.next_message < robot_.next_tick) return take_message();
    robot_.now = std::max(robot_.now, robot_.next_tick);
    if (interrupts_off_) {
        robot_.next_tick += robot_.tick_length;
        tick_pending_ = loop_due_ = true;
        return;
    }
    robot_.next_tick =
        robot_.ticks_are_ordinary() ? robot_.next_tick + robot_.tick_length : robot_.overflow;
    tick();
}

// Runs a callback with interrupts off and a budget of its own. Time that it takes by delay() is
// lost: one tick stays pending, messages are not received.
template <typename Callback>
inline void NativeRobot::interrupt(const kt_table_t &table, Callback callback) {
    in_interrupt_ = true;
    const Cycles before = robot_.now;
    int32_t &left = *table.budget;
    const int32_t budget = left, held_back = std::exchange(program_->turns_held_back, 0);
    left = TURNS_PER_TICK;
    callback();
    left = budget;
    program_->turns_held_back = held_back;
    in_interrupt_ = interrupts_off_ = false;
    look_at_outputs(*table.outputs, table.settle);
    if (robot_.now == before) return;
    while (robot_.next_tick != NEVER && robot_.next_tick + robot_.tick_length <= robot_.now)
        robot_.next_tick += robot_.tick_length;
    while (robot_.inbox_next < robot_.inbox.size() &&
           robot_.inbox[robot_.inbox_next].at < robot_.now)
        robot_.inbox_next++;
    robot_.inbox_changed();
}

inline void NativeRobot::count_tick(volatile uint32_t &ticks) {
    ticks = robot_.last_tick = ticks + 1;
    transmit_clock_match(&robot_.core.transmit);
}

void NativeRobot::tick() {
    const auto &table = program_->table();
    count_tick(*table.ticks);
    loop_due_ = true;
    if (robot_answer_is_due(&robot_.core.answer))
        interrupt(table, [this, &table] { try_to_answer(table); });
    else if (robot_.core.state == ROBOT_RUNNING &&
             transmit_clock_is_due(&robot_.core.transmit, tx_period(table)))
        interrupt(table, [this, &table] { ask_for_message(table); });
}

inline bool NativeRobot::may_be_asked() {
    return robot_.in_the_dark || ask_medium(Question::MAY_ASK);
}

inline void NativeRobot::ask_for_message(const kt_table_t &table) {
    const bool granted = robot_.may_send();
    if (!granted && !may_be_asked()) return;
    const message_t *message = (*table.message_tx)();
    robot_.nulls = message != nullptr ? 0 : std::min(robot_.nulls + 1, RobotRecord::QUIET);
    if (message == nullptr) return;
    if (!put_on_air(*message, granted)) return retry_soon();
    transmit_clock_sent(&robot_.core.transmit);
    (*table.message_tx_success)();
}

// The runtime's own frame: the program's transmit clock goes on as if there were none.
void NativeRobot::try_to_answer(const kt_table_t &table) {
    const bool granted = robot_.may_send();
    if (!granted && !may_be_asked()) return;
    const robot_heard_t heard = rare_ ? rare_->heard : robot_heard_t{};
    uint8_t content[REPORT_CONTENT];
    if (robot_.core.answer.first == ROBOT_QUERY_VITALS)
        robot_answer_vitals(&heard, robot_.voltage(robot_.now), content);
    else
        gains_saved(robot_.core.answer.first, content);
    message_t answer;
    robot_answer_fill(&robot_.core.answer, &answer, *table.uid, robot_.core.state, content);
    if (put_on_air(answer, granted)) robot_answer_end(&robot_.core.answer);
}

bool NativeRobot::put_on_air(const message_t &message, bool granted) {
    if (granted) {
        robot_.emit(message);
    } else {
        robot_.outgoing = message;
        if (!ask_medium(Question::IS_CHANNEL_FREE)) {
            robot_.now += SENSE_CYCLES;
            return false;
        }
    }
    if (robot_.context->frame > 0) wait_until(robot_.now + robot_.context->frame);
    return true;
}

bool NativeRobot::ask_medium(Question question) {
    robot_.question = question;
    suspend();
    return robot_.answer;
}

// The next match comes soon, counts as a tick and tries again (hardware.md 1.6).
void NativeRobot::retry_soon() {
    const uint8_t compare = transmit_clock_retry(&robot_.core.transmit, (*table().random)());
    const auto next =
        timer_matches_after_retry(robot_.now, robot_.next_tick, compare, robot_.tick_length);
    robot_.next_tick = next.match;
    robot_.overflow = next.ordinary;
}

void NativeRobot::take_message() {
    const Reception reception = robot_.inbox[robot_.inbox_next++];
    robot_.inbox_changed();
    robot_.now = std::max(robot_.now, reception.at);
    if (!receives(reception)) return;
    if (message_is_command(&reception.message)) {
        message_t command = reception.message;
        if (table().original != 0 && !original_knows(&command)) return;
        if (robot_answer_is_heard(&reception.message))
            robot_answer_hear(&written().heard, &reception.message, &reception.distance);
        return obey(command);
    }
    robot_.delivered++;
    if (robot_.context->listening != nullptr) [[unlikely]]
        write_down(reception);
    const auto &table = program_->table();
    *table.rx_message = reception.message;
    *table.rx_distance = reception.distance;
    if (stale_conversion_ >= 0) table.rx_distance->high_gain = stale_conversion_;
    stale_conversion_ = -1;
    interrupt(table, [&table] { (*table.message_rx)(table.rx_message, table.rx_distance); });
    loop_due_ = true;  // it sees at once what the callback changed
}

void NativeRobot::write_down(const Reception &reception) const {
    Listening &listening = *robot_.context->listening;
    const auto &robots = listening.robots;
    if (std::find(robots.begin(), robots.end(), robot_.index) == robots.end()) return;
    const auto mm = robot_.context->gains_are_mm
                        ? static_cast<uint8_t>(std::clamp<int>(reception.distance.low_gain, 0, 255))
                        : robot_.calibration.gains.estimate_mm(reception.distance);
    listening.heard.push_back({reception.at, robot_.index, mm, reception.message});
}

// Time passes up to `wake`; interrupts at that moment come before the program goes on.
void NativeRobot::wait_until(Cycles wake) {
    robot_.only_ticks_until = 0;
    if (robot_.core.state == ROBOT_SETUP && !in_interrupt_) acts_at_ = wake;
    look_at_outputs();
    for (;;) {
        while (!in_interrupt_ && robot_.next_interrupt() <= wake &&
               robot_.next_interrupt() < robot_.until)
            serve_interrupt();
        if (wake < robot_.until) break;
        if (in_interrupt_ && wake > robot_.next_tick)
            robot_.waits_past_tick = static_cast<uint32_t>(wake - robot_.next_tick);
        suspend();
        robot_.waits_past_tick = 0;
    }
    robot_.now = std::max(robot_.now, wake);
}

}  // namespace kilotwin
