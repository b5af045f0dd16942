#include "grid/grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "address.h"
#include "base/errors.h"

namespace kilotwin {

namespace {

// As many as the host's software queues hold before it has to wait.
constexpr size_t HOST_QUEUE = 4096;
// A module's answer to a poll, ten records and their announcement, and whatever its program sends
// meanwhile.
constexpr size_t MODULE_QUEUE = 32;
constexpr double CLOCK_LIMIT = 3;  // of the spread

}  // namespace

Grid::Grid(const Settings &settings, const Chance &chance, Cycles power_up, Cycles zero,
           bool run_ahead, ModuleDriver &driver)
    : layout_(settings.columns, settings.rows, settings.buses),
      infrared_(settings.infrared),
      chance_(chance),
      driver_(driver),
      zero_(zero),
      run_ahead_(run_ahead),
      faults_(settings.faults),
      due_(layout_.modules()),
      robots_about_(layout_.modules(), 0),
      frames_in_flight_(layout_.modules(), 0),
      dead_(layout_.modules(), false),
      bus_due_(layout_.buses(), NEVER),
      host_queue_(layout_.buses()),
      robots_near_(layout_.cells()) {
    for (const Fault &fault : faults_)
        if (fault.x >= layout_.columns() || fault.y >= layout_.rows())
            throw EngineError("a fault names module " + std::to_string(fault.x) + ", " +
                              std::to_string(fault.y) + ", which the grid does not have");
    std::stable_sort(faults_.begin(), faults_.end(),
                     [](const Fault &a, const Fault &b) { return a.at_tick < b.at_tick; });
    create_modules(power_up);
    attach_to_buses(settings.error_share);
}

void Grid::create_modules(Cycles power_up) {
    for (uint32_t index = 0; index < layout_.modules(); index++) {
        const double when = chance_.uniform(index, Purpose::MODULE_POWER_UP, 0);
        const double luck =
            std::clamp(chance_.normal(index, Purpose::MODULE_CLOCK, 0), -CLOCK_LIMIT, CLOCK_LIMIT);
        const double tick = static_cast<double>(TICK_CYCLES) * (1 + infrared_.clock_spread * luck);
        driver_.add(static_cast<uint8_t>(layout_.x(index)), static_cast<uint8_t>(layout_.y(index)),
                    static_cast<Cycles>(std::llround(tick)),
                    static_cast<Cycles>(when * static_cast<double>(power_up)));
        schedule(index);
    }
}

void Grid::attach_to_buses(double error_share) {
    for (uint32_t bus = 0; bus < layout_.buses(); bus++) {
        buses_.emplace_back(CanBus::Settings{error_share}, chance_, bus);
        buses_.back().attach({"host", {{KILOGRID_HOST_ID, KILOGRID_HOST_MASK}}, HOST_QUEUE});
        module_of_node_.push_back({UINT32_MAX});
    }
    for (uint32_t index = 0; index < layout_.modules(); index++) {
        CanBus::Node node;
        node.name = std::to_string(layout_.x(index)) + ", " + std::to_string(layout_.y(index));
        for (uint16_t id : driver_.filters(index))
            node.filters.emplace_back(id, KILOGRID_MODULE_MASK);
        node.tx_queue = MODULE_QUEUE;
        const uint32_t bus = layout_.bus(index);
        node_.push_back(buses_[bus].attach(node));
        module_of_node_[bus].push_back(index);
    }
}

// Robots near cells

double Grid::range_m(uint32_t robot, Cycles at) const {
    if (infrared_.weak_share == 0) return infrared_.robot_range_m;
    // Robots' spells do not begin together.
    const double phase = chance_.uniform(robot, Purpose::WEAK_LIGHT, 0);
    const auto spell = static_cast<uint64_t>(seconds(at) / infrared_.weak_spell_s + phase);
    const bool weak = chance_.uniform(robot, Purpose::WEAK_LIGHT, 1 + spell) < infrared_.weak_share;
    return weak ? infrared_.weak_range_m : infrared_.robot_range_m;
}

void Grid::look_around(Cycles until, double way_m, std::span<const Eigen::Vector2d> positions) {
    const double farthest =
        std::max({infrared_.cell_range_m, infrared_.robot_range_m, infrared_.weak_range_m});
    lists_until_ = until;
    for (auto &robots : robots_near_) robots.clear();
    std::fill(robots_about_.begin(), robots_about_.end(), 0);
    cells_near_.resize(positions.size());
    for (uint32_t robot = 0; robot < positions.size(); robot++) {
        cells_near_[robot].clear();
        layout_.for_each_within(positions[robot], farthest + way_m, [&](uint32_t cell, double) {
            cells_near_[robot].push_back(cell);
            robots_near_[cell].push_back(robot);
            robots_about_[GridLayout::module_of(cell)]++;
        });
    }
}

/// Whether nothing but itself can make the module do something before limit_ and lists_until_.
bool Grid::has_lookahead(uint32_t module) const {
    return run_ahead_ && !driver_.acts_alone() && robots_about_[module] == 0 &&
           frames_in_flight_[module] == 0;
}

// Modules

std::optional<Grid::Question> Grid::run(Cycles until) {
    driver_.pass_frames(*this);
    for (;;) {
        const Cycles module_at = due_.first_at(), fault_at = next_fault();
        const Cycles bus_at = bus_due_[first_bus_];
        if (std::min({module_at, fault_at, bus_at}) >= until) return std::nullopt;
        if (bus_at <= std::min(fault_at, module_at)) {
            run_bus(first_bus_, bus_at + 1);
        } else if (fault_at <= module_at) {
            apply(faults_[next_fault_++], fault_at);
        } else {
            const uint32_t module = due_.first();
            if (const auto asks = attend(module, module_at)) return Question{module, *asks};
        }
    }
}

/// Executes a module that is due, and schedules it anew unless it asks.
std::optional<CellEmission> Grid::attend(uint32_t index, Cycles at) {
    const Cycles until = has_lookahead(index)
                             ? std::max(std::min({limit_, lists_until_, next_fault()}), at + 1)
                             : at + 1;
    const auto ran = driver_.run(index, until, robots_about_[index] > 0, *this);
    counts.sent += ran.unheard;
    counts.unheard += ran.unheard;
    schedule(index, until);
    return ran.asks;
}

void Grid::answer(uint32_t index, Cycles asked, Module::Answer answer) {
    if (dead_[index] || !driver_.answer(index, asked, answer)) return;
    if (answer == Module::Answer::SENT)
        counts.sent++;
    else
        counts.put_off++;
    schedule(index);
}

/// Notes when a module has to be executed next.
void Grid::schedule(uint32_t index, Cycles not_before) {
    const Cycles at = dead_[index] ? NEVER : driver_.next_event(index);
    due_.set(index, std::max(at, not_before));
}

void Grid::receive_ir(Cycles at, uint32_t cell, const message_t &message,
                      distance_measurement_t distance, bool crc_error) {
    const uint32_t module = GridLayout::module_of(cell);
    if (dead_[module]) return;
    driver_.receive_ir(module, at, GridLayout::index_in_module(cell), message, distance, crc_error);
    schedule(module);
}

CellLight Grid::light(uint32_t cell, Cycles at) {
    const uint32_t module = GridLayout::module_of(cell);
    if (dead_[module]) return {};
    driver_.catch_up(module, at);
    return driver_.light(module, GridLayout::index_in_module(cell), at);
}

void Grid::catch_up(uint32_t index, Cycles at) {
    if (!dead_[index]) driver_.catch_up(index, at);
}

ModuleDriver::About Grid::about(uint32_t index, Cycles at) {
    catch_up(index, at);
    auto about = driver_.about(index);
    if (dead_[index]) about.state = "dead";
    return about;
}

// Buses

bool Grid::send_can(Cycles now, uint32_t bus, const CanFrame &frame) {
    if (bus >= layout_.buses())
        throw EngineError("there is no bus " + std::to_string(bus) + "; the grid has " +
                          std::to_string(layout_.buses()) + ", from 0");
    if (!buses_[bus].queue(HOST, now, frame)) return false;
    schedule_bus(bus);
    host_queue_[bus].push_back(frame.id);
    for_each_taker(bus, frame.id, [&](uint32_t module) { frames_in_flight_[module]++; });
    return true;
}

void Grid::run_bus(uint32_t index, Cycles until) {
    CanBus &bus = buses_[index];
    bus.run(until, [&](const CanBus::Delivery &delivery) { deliver(index, delivery); });
    if (!host_queue_[index].empty() && bus.queued(HOST) == 0) end_flight(index, false);
    schedule_bus(index);
}

/// Notes when something happens on a bus next; called after every change of it.
void Grid::schedule_bus(uint32_t bus) {
    bus_due_[bus] = buses_[bus].next();
    const auto first = std::min_element(bus_due_.begin(), bus_due_.end());
    first_bus_ = static_cast<uint32_t>(first - bus_due_.begin());
}

void Grid::deliver(uint32_t bus, const CanBus::Delivery &delivery) {
    const bool from_host = delivery.sender == HOST;
    frames_.push_back({delivery.at, bus, delivery.frame, from_host});
    if (from_host) end_flight(bus, true);
    if (!from_host) driver_.frame_sent(module_of_node_[bus][delivery.sender], delivery.at);
    for (uint32_t node : *delivery.receivers) {
        if (node == HOST) continue;
        const uint32_t index = module_of_node_[bus][node];
        if (dead_[index]) continue;
        driver_.receive_can(index, delivery.at, delivery.frame, errors(index));
        schedule(index);
    }
}

void Grid::queue(uint32_t module, const CanOutput &output) {
    bus_of(module).queue(node_[module], output.at, output.frame);
    schedule_bus(layout_.bus(module));
}

size_t Grid::queued(uint32_t module) const { return bus_of(module).queued(node_[module]); }

CanErrors Grid::errors(uint32_t module) const {
    const CanBus &bus = bus_of(module);
    const uint32_t node = node_[module];
    return {bus.transmit_errors(node), bus.receive_errors(node),
            bus.state(node) == CanBus::State::BUS_OFF};
}

bool Grid::sends(uint32_t module) const {
    return bus_of(module).state(node_[module]) < CanBus::State::BUS_OFF;
}

/// The modules of a bus that take frames with this identifier.
template <typename Visit> void Grid::for_each_taker(uint32_t bus, uint16_t id, Visit visit) const {
    kilogrid_address_t to;
    if (!kilogrid_address(id, &to) || to.type == ADDR_DISPATCHER) return;
    for (uint32_t y = layout_.first_row(bus); y < layout_.first_row(bus + 1); y++) {
        if ((to.type == ADDR_ROW || to.type == ADDR_INDIVIDUAL) && y != to.y) continue;
        for (uint32_t x = 0; x < layout_.columns(); x++)
            if ((to.type != ADDR_COLUMN && to.type != ADDR_INDIVIDUAL) || x == to.x)
                visit(layout_.module(x, y));
    }
}

/// The host's first frame, or all that it had queued on the bus, are no longer in flight.
void Grid::end_flight(uint32_t bus, bool one) {
    auto &queue = host_queue_[bus];
    while (!queue.empty()) {
        for_each_taker(bus, queue.front(), [&](uint32_t module) { frames_in_flight_[module]--; });
        queue.pop_front();
        if (one) return;
    }
}

std::vector<Grid::LoggedFrame> Grid::take_frames() {
    // Buses are run one after the other.
    std::stable_sort(frames_.begin(), frames_.end(), [](const auto &a, const auto &b) {
        return a.at != b.at ? a.at < b.at : a.bus < b.bus;
    });
    return std::exchange(frames_, {});
}

Events Grid::take_events(Cycles at) {
    for (uint32_t index = 0; index < layout_.modules(); index++) catch_up(index, at);
    Events events = driver_.take_events();
    std::stable_sort(events.begin(), events.end(), [](const Event &a, const Event &b) {
        return a.at != b.at ? a.at < b.at : a.robot < b.robot;
    });
    return events;
}

// Faults

Cycles Grid::fault_time(const Fault &fault) const {
    return zero_ + static_cast<Cycles>(fault.at_tick) * TICK_CYCLES;  // negative ticks wrap
}

void Grid::apply(const Fault &fault, Cycles at) {
    const uint32_t index = layout_.module(fault.x, fault.y), node = node_[index];
    CanBus &bus = bus_of(index);
    run_bus(layout_.bus(index), at);
    catch_up(index, at);
    switch (fault.kind) {
    case Fault::Kind::DEAD:
        dead_[index] = true;
        driver_.set_power(index, at, false);
        bus.kill(node, at);
        break;
    case Fault::Kind::RESET:
        bus.kill(node, at);
        bus.recover(node, at);
        dead_[index] = false;
        driver_.set_power(index, at, true);
        break;
    case Fault::Kind::BUS_OFF: bus.bus_off(node, at, true); break;
    case Fault::Kind::RECOVER:
        bus.recover(node, at);
        if (dead_[index]) driver_.set_power(index, at, true);
        dead_[index] = false;
        break;
    }
    schedule_bus(layout_.bus(index));
    schedule(index);
}

}  // namespace kilotwin
