#include "simulation/simulation.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <string>
#include <string_view>
#include <utility>

#include "base/errors.h"
#include "base/selection.h"
#include "base/trigonometry.h"

namespace kilotwin {

namespace {

/// Takes events before `now` out, in order of time. What a robot did at the end of its last
/// instruction or wait may be later than the others have been executed.
Events take_before(Events &events, Cycles now) {
    std::stable_sort(events.begin(), events.end(), [](const Event &a, const Event &b) {
        return a.at != b.at ? a.at < b.at : a.robot < b.robot;
    });
    const auto later = std::partition_point(events.begin(), events.end(),
                                            [now](const Event &event) { return event.at < now; });
    Events taken(std::move_iterator(events.begin()), std::move_iterator(later));
    events.erase(events.begin(), later);
    return taken;
}

}  // namespace

int64_t Simulation::tick_of(Cycles at) const {
    static_assert(std::has_single_bit(TICK_CYCLES));
    return static_cast<int64_t>(at - run_at_) >> std::countr_zero(TICK_CYCLES);
}

// The loop

void Simulation::advance(int64_t ticks) {
    NativeGuest::serve_this_thread();
    note_work(true);
    const Cycles end = end_of_step(now_ + static_cast<Cycles>(ticks) * TICK_CYCLES, step_);
    channel_->host_silent_until(end);
    // Robots are run ahead up to the next sample at most: it shows them as they are then.
    while (now_ < end) {
        step(std::min(end, next_sample_));
        sample_if_due();
    }
    note_work(false);
}

void Simulation::note_work(bool goes_on) {
    if (black_box_ != nullptr) black_box_->at_work = goes_on;
}

void Simulation::step(Cycles limit) {
    const Cycles end = now_ + step_;
    team_.work_alone(notes_in_order());
    break_robots();
    give_commands(end);
    const Cycles told = std::min({commands_.next_at(), faults_.next_at(), channel_->next_light()});
    limit = std::min(limit, std::max(end, begin_of_step(told, step_)));
    if (bodies_.refresh_lists()) channel_->lists_changed();
    floor_.begin_step(now_);
    sense_on_boards();
    tell_ahead_of_channel(end);
    channel_->run(now_, end, floor_.not_beyond(limit));
    // Chips have been executed within run(), up to the end of the step.
    for (uint32_t robot : boards_.robots()) take_motor_commands(robot);
    run_due_robots(limit);
    channel_->end_step();
    bodies_.step();
    now_ = end;
    steps_++;
    if (black_box_ != nullptr) black_box_->steps = steps_;
    floor_.end_step(now_);
}

/// No robot has been run beyond the begin of the step in which a failure is due; one that is due
/// within it comes with the next.
void Simulation::break_robots() {
    faults_.take(now_ + 1, [this](const RobotFault &fault, Cycles) { break_robot(fault); });
}

void Simulation::break_robot(const RobotFault &fault) {
    const uint32_t slot = slots_.slot_of(fault.robot);
    Robot &robot = robots_[slot];
    if (robot.stopped()) return;
    channel_->settle(slot);
    const bool on_board = boards_.has(slot);
    const uint32_t tick = on_board ? boards_.board(slot).tick() : robot.last_tick();
    switch (fault.kind) {
    case RobotFault::Kind::DEAD:
        robot.die(now_, tick);
        if (on_board) boards_.switch_off(slot);
        take_motor_commands(slot);
        break;
    case RobotFault::Kind::DEAF: robot.deafen(now_, tick); break;
    case RobotFault::Kind::RECEIVES: robot.receive_again(now_, tick); break;
    case RobotFault::Kind::MUTE: robot.mute(now_, tick); break;
    case RobotFault::Kind::TRANSMITS: robot.transmit_again(now_, tick); break;
    case RobotFault::Kind::MOTORS:
        robot.report_fault(now_, tick, fault.left == 0 && fault.right == 0 ? "stuck" : "drift");
        bodies_.scale_motors(slot, fault.left, fault.right);
        floor_.disturb(slot, now_);
        break;
    }
    channel_->failed(slot);
}

/// Hands out the commands before `until`.
void Simulation::give_commands(Cycles until) {
    commands_.take(
        until, [this](const Command &command, Cycles at) { give(command, std::max(at, now_)); });
}

/// Not light on the channel: no message is lost, whatever is on air.
void Simulation::give(const Command &command, Cycles at) {
    for (uint32_t slot = 0; slot < size(); slot++) {
        Robot &robot = robots_[slot];
        if (!command.is_for(robot.uid())) continue;
        if (!command.is_everywhere() &&
            (bodies_.position(slot) - command.centre).norm() > command.radius_m)
            continue;
        robot.receive_beside(at, command.message, Trail::Kind::COMMAND);
        channel_->order(slot, at);
    }
}

void Simulation::shine_from_above(const message_t &message, Cycles at, uint32_t controller) {
    if (controller >= channel_->controllers())
        throw EngineError("there is no overhead controller " + std::to_string(controller));
    channel_->shine_from_above(message, std::max(at, now_), controller);
}

void Simulation::place(size_t robot, const Pose &pose) {
    const uint32_t slot = slot_of(robot);
    if (!bodies_.has_room(slot, pose.position))
        throw EngineError("robot " + std::to_string(robot) + " has no room there");
    put(slot, pose);
}

void Simulation::turn(size_t robot, double heading) {
    const uint32_t slot = slot_of(robot);
    put(slot, {bodies_.position(slot), heading});
}

uint32_t Simulation::slot_of(size_t robot) const {
    if (robot >= size()) throw EngineError("there is no robot " + std::to_string(robot));
    return slots_.slot_of(static_cast<uint32_t>(robot));
}

/// A robot's surroundings are known from where it stood: bodies, lists and floor
/// find it anew. Robots have not been run beyond now_ (advance()), so nothing they did is undone.
void Simulation::put(uint32_t slot, const Pose &pose) {
    bodies_.place(slot, {pose.position, wrapped(pose.heading)});
    floor_.look_again();
}

void Simulation::set_ambient(double reading) {
    def_.light.ambient = reading;
    shine_on_robots();
}

void Simulation::set_peak(size_t lamp, double reading) {
    if (lamp >= def_.light.sources.size())
        throw EngineError("there is no lamp " + std::to_string(lamp));
    def_.light.sources[lamp].peak = reading;
    shine_on_robots();
}

/// Between two calls of advance() no robot has been executed beyond now_.
void Simulation::shine_on_robots() {
    for (uint32_t robot = 0; robot < robots_.size(); robot++)
        robots_[robot].set_light(def_.light.at(bodies_.position(robot), def_.arena));
}

/// Sets readings and floor messages of robots on boards for this step.
void Simulation::sense_on_boards() {
    for (uint32_t robot : boards_.robots()) {
        robots_[robot].set_light(def_.light.at(bodies_.position(robot), def_.arena));
        floor_.look(robot, NEVER, false);
        floor_.tell(robot, robots_[robot], now_ + step_);
    }
}

/// A channel that executes robots does so past what the floor tells in this step.
void Simulation::tell_ahead_of_channel(Cycles end) {
    if (!channel_->executes_robots() || !floor_.tells_before(end)) return;
    for (uint32_t robot = 0; robot < size(); robot++) {
        if (wake_[robot] > now_) continue;  // executed beyond, and told
        floor_.look(robot, NEVER, !def_.run_ahead);
        floor_.tell(robot, robots_[robot], end);
    }
}

/// First finds how far each can be run, as all stand when the step begins, then runs them: neither
/// depends on the order of robots.
void Simulation::run_due_robots(Cycles limit) {
    team_.share(size(), [&](uint32_t share, size_t begin, size_t end) {
        find_due(shares_[share], begin, end, limit);
    });
    team_.share([this](uint32_t share) { run_share(shares_[share]); });
    // The floor tells robots of other shares.
    if (!floor_.exists()) return;
    for (const Share &share : shares_)
        for (const uint32_t robot : share.due) take_motor_commands(robot);
}

void Simulation::find_due(Share &share, size_t begin, size_t end, Cycles limit) {
    choose(share.due, begin, end, [this](uint32_t robot) { return wake_[robot] <= now_; });
    share.until.resize(share.due.size());
    for (size_t i = 0; i < share.due.size(); i++) {
        prefetch_lookahead_after(share, i);
        share.until[i] = run_until(share.due[i], limit);
    }
}

Cycles Simulation::run_until(uint32_t robot, Cycles limit) {
    const Cycles end = now_ + step_;
    limit = floor_.look(robot, limit, !def_.run_ahead);
    // Less than a step brings nothing: it would be due in the next one all the same.
    if (limit <= end || !may_run_ahead()) return end;
    return std::max(channel_->lookahead(robot, end + step_, limit), end);
}

void Simulation::run_share(Share &share) {
    for (size_t i = 0; i < share.due.size(); i++) {
        prefetch_due_after(share, i);
        const uint32_t robot = share.due[i];
        const Cycles until = share.until[i];
        if (light_changes())
            robots_[robot].set_light(def_.light.at(bodies_.position(robot), def_.arena));
        floor_.tell(robot, robots_[robot], until);
        channel_->run_robot(robot, until);
        if (floor_.exists())
            wake_when_due(robot, until);
        else
            ran_ahead(robot, until);
    }
    if (shares_.size() > 1 && share.context.black_box != nullptr)
        share.context.black_box->runs(BlackBox::NONE, 0);
}

/// A robot has been executed up to `until`.
void Simulation::ran_ahead(uint32_t robot, Cycles until) {
    if (!robots_[robot].motor_commands().empty()) take_motor_commands(robot);
    wake_when_due(robot, until);
}

/// It is not due before. Where it waits for the channel's answer it goes on in that step.
void Simulation::wake_when_due(uint32_t robot, Cycles until) {
    const bool waits = robots_[robot].question() != Robot::Question::NONE;
    wake_[robot] = begin_of_step(waits ? robots_[robot].now() : until, step_);
}

void Simulation::take_motor_commands(uint32_t robot) {
    for (const auto &command : robots_[robot].motor_commands()) {
        bodies_.command(robot, {std::max(command.at, now_), command.left, command.right});
        floor_.disturb(robot, command.at);
    }
    robots_[robot].motor_commands().clear();
}

/// Brings into the cache what run_until() needs of the robots due some turns after the i-th.
void Simulation::prefetch_lookahead_after(const Share &share, size_t i) const {
    constexpr size_t SOON = 4, LATER = 8, LATEST = 12;
    if (!prefetches(size()) || i + LATEST >= share.due.size()) return;
    robots_[share.due[i + LATEST]].prefetch_life();
    channel_->prefetch_lookahead(share.due[i + SOON], share.due[i + LATER], share.due[i + LATEST]);
}

/// The same of run_share().
void Simulation::prefetch_due_after(const Share &share, size_t i) const {
    constexpr size_t LATER = 5, LATEST = 8;
    if (!prefetches(size()) || i + LATEST >= share.due.size()) return;
    const uint32_t latest = share.due[i + LATEST];
    robots_[latest].prefetch();
    bodies_.prefetch(latest);
    channel_->prefetch(latest);
    robots_[share.due[i + LATER]].prefetch_state();
}

bool Simulation::notes_in_order() const {
    return trail_ != nullptr || debugging_ != nullptr || written_ != nullptr;
}

/// Events of shares, one after the other: take_before() puts them in order of time.
void Simulation::gather_events() {
    for (Share &share : shares_) {
        events_.insert(events_.end(), std::move_iterator(share.events.begin()),
                       std::move_iterator(share.events.end()));
        share.events.clear();
    }
}

// Results

Grid &Simulation::grid() {
    if (!grid_) throw EngineError("this run has no grid");
    return *grid_;
}

const Grid &Simulation::grid() const { return const_cast<Simulation *>(this)->grid(); }

Statistics Simulation::statistics() const {
    std::optional<uint64_t> delivered = 0;
    for (const Robot &robot : robots_) {
        if (robot.delivered() == Robot::NOT_KNOWN)
            delivered.reset();
        else if (delivered)
            *delivered += robot.delivered();
    }
    return {steps_,
            channel_->counts(),
            delivered,
            bodies_.solver_steps(),
            bodies_.island_steps(),
            bodies_.list_rebuilds(),
            bodies_.overlaps()};
}

void Simulation::sample_if_due() {
    if (now_ < next_sample_) return;
    sample_into(samples_, def_.sample_extras);
    result_.take(samples_);
    const Cycles period = def_.sample_ticks * TICK_CYCLES;
    const Cycles periods = (now_ - run_at_) / period + 1;
    next_sample_ = end_of_step(run_at_ + periods * period, step_);
}

void Simulation::sample_into(Samples &samples, const SampleExtras &extras) const {
    samples.tick.push_back(tick());
    for (uint32_t index = 0; index < size(); index++) {
        const uint32_t slot = slots_.slot_of(index);
        const Pose pose = bodies_.pose(slot);
        samples.add_robot(pose, robots_[slot].color(now_), def_.arena.site_at(pose.position));
    }
    for (uint32_t object = 0; object < bodies_.objects(); object++)
        samples.add_object(bodies_.object_pose(object));
    add_extras(samples, extras);
}

// Robots have been executed up to now_, and frames counted so far.
void Simulation::add_extras(Samples &samples, const SampleExtras &extras) const {
    if (extras.motors)
        for (size_t i = 0; i < size(); i++)
            samples.add_motors(robot(i).left_duty(), robot(i).right_duty());
    if (extras.battery)
        for (size_t i = 0; i < size(); i++) samples.add_battery(robot(i).voltage(now_));
    if (!extras.messages) return;
    const auto sent_and_received = frames();
    for (size_t i = 0; i < size(); i++)
        samples.add_messages(sent_and_received[i], robot(i).delivered());
}

void Simulation::listen_to(const std::vector<uint32_t> &robots) {
    for (Share &share : shares_) {
        share.listening = {robots};
        share.context.listening = robots.empty() ? nullptr : &share.listening;
    }
}

Trail &Simulation::keep_trail(size_t capacity, bool of_code) {
    const uint32_t cells = grid_ ? grid_->layout().cells() : 0;
    trail_ = std::make_unique<Trail>(slots_, static_cast<uint32_t>(def_.beacons.size()), cells,
                                     capacity);
    for (Share &share : shares_) share.context.trail = of_code ? trail_.get() : nullptr;
    return *trail_;
}

Trail &Simulation::trail() const {
    if (!trail_) throw EngineError("no trail is kept");
    return *trail_;
}

std::vector<Heard> Simulation::heard_by(uint32_t robot) const {
    const auto &noted = shares_[this->robot(robot).share()].listening.heard;
    std::vector<Heard> heard;
    std::copy_if(noted.begin(), noted.end(), std::back_inserter(heard),
                 [&](const Heard &one) { return one.robot == robot && one.at < now_; });
    auto bytes = [](const Heard &one) {
        return std::string_view(reinterpret_cast<const char *>(&one.message), sizeof one.message);
    };
    std::sort(heard.begin(), heard.end(), [&](const Heard &a, const Heard &b) {
        return a.at != b.at ? a.at < b.at : bytes(a) < bytes(b);
    });
    const auto twice = [&](const Heard &a, const Heard &b) {
        return a.at == b.at && bytes(a) == bytes(b);
    };
    heard.erase(std::unique(heard.begin(), heard.end(), twice), heard.end());
    return heard;
}

std::vector<FrameCounts> Simulation::frames() const {
    const auto by_slot = channel_->frames();
    std::vector<FrameCounts> counts;
    counts.reserve(size());
    for (uint32_t index = 0; index < size(); index++)
        counts.push_back(by_slot[slots_.slot_of(index)]);
    return counts;
}

Samples Simulation::take_samples() { return std::exchange(samples_, {}); }

Samples Simulation::snapshot(const SampleExtras &extras) const {
    Samples samples;
    sample_into(samples, extras);
    return samples;
}

Events Simulation::take_events() {
    gather_events();
    Events taken = take_before(events_, now_);
    result_.take(taken, run_at_);
    return taken;
}

Events Simulation::take_module_events() {
    fetch_module_events();
    return take_before(module_events_, now_);
}

// Boards and native modules keep theirs until they are asked; the hash wants all of them.
void Simulation::fetch_module_events() {
    NativeGuest::serve_this_thread();
    const Events events = grid().take_events(now_);
    result_.take(events, run_at_);
    module_events_.insert(module_events_.end(), events.begin(), events.end());
}

uint64_t Simulation::result_hash() {
    if (grid_) fetch_module_events();
    gather_events();
    ResultHash result = result_;
    result.take(events_, run_at_);
    // With the ideal medium who receives what follows from samples and counts.
    const auto counts = def_.kilobot_medium ? frames() : std::vector<FrameCounts>{};
    return result.value(snapshot(), channel_->counts(), counts);
}

}  // namespace kilotwin
