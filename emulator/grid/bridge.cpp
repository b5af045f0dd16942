#include "grid/bridge.h"

#include <signal.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>

#include "grid/bridge_loop.h"

namespace kilotwin {

namespace {

// Per bus, frames from outside that the simulation has not yet published.
constexpr size_t ECHOES = 1 << 14;
constexpr size_t NOTES = 1000;
// Interfaces with a full queue do not report when they have room again.
constexpr auto RETRY = std::chrono::milliseconds(1);

}  // namespace

// Everything that can fail is opened before the thread starts.
Bridge::Loop::Loop(const Settings &settings)
    : settings_(settings),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      echoes_(settings.buses) {
    if (epoll_.get() < 0 || wake_.get() < 0) fail("no event queue");
    if (settings.interfaces.empty()) {
        open_server();
    } else {
        open_interfaces();
    }
    watch(wake_.get(), EPOLLIN, false);
    // Signals are for the program's own threads.
    sigset_t all, before;
    sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    thread_ = std::thread([this] { run(); });
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Bridge::Loop::~Loop() {
    {
        std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    wake();
    thread_.join();
}

// Called by the simulation's thread

/// Queues frames for the thread, each with its origin: a frame from the host is an echo of the
/// oldest equal frame that came from outside.
void Bridge::Loop::publish(std::span<const CanRecord> frames) {
    if (frames.empty()) return;
    {
        std::lock_guard lock(mutex_);
        counts_.published += frames.size();
        for (const CanRecord &record : frames) {
            if (record.bus >= settings_.buses || record.dlc > CanFrame::DATA_MAX ||
                outgoing_.size() >= QUEUE_FRAMES) {
                counts_.lost_outgoing++;
                continue;
            }
            Origin origin = SIMULATION;
            auto &echoes = echoes_[record.bus];
            CanFrame frame = {record.id, record.dlc, false, record.data};
            auto is_echo = [&](const Echo &echo) { return echo.frame == frame; };
            if (record.from_host != 0) {
                auto found = std::find_if(echoes.begin(), echoes.end(), is_echo);
                if (found != echoes.end()) {
                    // Frames of one node keep their order on the bus: those before it were lost.
                    origin = found->origin;
                    echoes.erase(echoes.begin(), found + 1);
                }
            }
            outgoing_.push_back({record, origin});
        }
    }
    wake();
}

std::vector<Bridge::Request> Bridge::Loop::take() {
    std::vector<Request> requests;
    {
        std::lock_guard lock(mutex_);
        if (incoming_.empty()) return {};
        requests.swap(incoming_);
        pending_.clear();
        counts_.taken += requests.size();
    }
    // Clients that were not read any further may be read again.
    wake();
    return requests;
}

// The thread

void Bridge::Loop::wake() {
    uint64_t one = 1;
    // A full counter, the only failure, wakes as well.
    [[maybe_unused]] ssize_t written = ::write(wake_.get(), &one, sizeof one);
}

void Bridge::Loop::watch(int fd, uint32_t events, bool again) {
    epoll_event event = {};
    event.events = events;
    event.data.fd = fd;
    ::epoll_ctl(epoll_.get(), again ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, fd, &event);
}

void Bridge::Loop::note(const std::string &text) {
    std::lock_guard lock(mutex_);
    if (notes_.size() < NOTES) notes_.push_back(text);
}

/// Time-out of the next wait, ms: until held frames are due or an interface is tried again; -1:
/// none.
int Bridge::Loop::wait_ms() const {
    auto now = Clock::now(), until = Clock::time_point::max();
    for (const auto &[fd, client] : clients_)
        if (!client.held.empty()) until = std::min(until, client.settled);
    for (const auto &interface : interfaces_)
        if (!interface.waiting.empty()) until = std::min(until, now + RETRY);
    if (until == Clock::time_point::max()) return -1;
    auto ms = std::chrono::ceil<std::chrono::milliseconds>(until - now).count();
    return static_cast<int>(std::max<int64_t>(ms, 0));
}

void Bridge::Loop::run() {
    std::array<epoll_event, 64> events;
    for (;;) {
        int count = ::epoll_wait(epoll_.get(), events.data(), events.size(), wait_ms());
        {
            std::lock_guard lock(mutex_);
            if (stopping_) return;
        }
        for (int i = 0; i < count; i++) dispatch(events[static_cast<size_t>(i)].data.fd);
        for (uint32_t bus = 0; bus < interfaces_.size(); bus++) read(bus);
        distribute();
        for (auto &[fd, client] : clients_) {
            release_held(client);
            write(client);
            update_interest(client);
        }
        forget_gone();
        for (uint32_t bus = 0; bus < interfaces_.size(); bus++) write(bus);
    }
}

/// Serves a descriptor that is ready.
void Bridge::Loop::dispatch(int fd) {
    if (fd == wake_.get()) {
        uint64_t times;
        [[maybe_unused]] ssize_t got = ::read(fd, &times, sizeof times);
    } else if (fd == listener_.get()) {
        accept_clients();
    } else if (auto found = clients_.find(fd); found != clients_.end()) {
        read(found->second);
    }
}

void Bridge::Loop::distribute() {
    batch_.clear();
    {
        std::lock_guard lock(mutex_);
        batch_.swap(outgoing_);
    }
    for (const Outgoing &outgoing : batch_)
        if (interfaces_.empty())
            distribute_to_clients(outgoing);
        else
            distribute_to_interface(outgoing);
}

/// Queues a frame from outside for take(), and remembers its origin until it has ended on the bus.
void Bridge::Loop::enqueue(uint32_t bus, Origin origin, const CanFrame &frame) {
    std::lock_guard lock(mutex_);
    if (incoming_.size() >= QUEUE_FRAMES) {
        counts_.lost_incoming++;
        return;
    }
    incoming_.push_back({bus, frame, std::chrono::steady_clock::now()});
    pending_[origin]++;
    auto &echoes = echoes_[bus];
    echoes.push_back({frame, origin});
    if (echoes.size() > ECHOES) echoes.pop_front();
}

Bridge::Bridge(const Settings &settings) : loop_(std::make_unique<Loop>(settings)) {}
Bridge::~Bridge() = default;
uint16_t Bridge::port() const { return loop_->port(); }
void Bridge::publish(std::span<const CanRecord> frames) { loop_->publish(frames); }
std::vector<Bridge::Request> Bridge::take() { return loop_->take(); }
Bridge::Counts Bridge::counts() const { return loop_->counts(); }
size_t Bridge::clients() const { return loop_->clients(); }
std::vector<std::string> Bridge::notes() { return loop_->notes(); }

}  // namespace kilotwin
