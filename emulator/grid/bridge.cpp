#include "grid/bridge.h"

#include <arpa/inet.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "grid/socketcand.h"

namespace kilotwin {

namespace {

using Clock = std::chrono::steady_clock;

// Frames that wait for the thread, for take(), or for an interface: half a minute of four full
// buses.
constexpr size_t QUEUE_FRAMES = 1 << 18;
// Frames from outside that the simulation has not yet published.
constexpr size_t REMEMBERED = 1 << 14;
constexpr size_t NOTES = 1000;
constexpr size_t READ_BYTES = 16 * 1024;
// Linux grants twice as much at most as the system's limit, unless we are privileged.
constexpr int SOCKET_BUFFER_BYTES = 8 << 20;
constexpr int BACKLOG = 16;
constexpr auto RETRY = std::chrono::milliseconds(1);

using Origin = uint64_t;
constexpr Origin NOBODY = 0;     ///< within the simulation
constexpr Origin INTERFACE = 1;  ///< a program at the SocketCAN interface
constexpr Origin FIRST_CLIENT = 2;

/// A file descriptor that closes itself.
class Descriptor {
  public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    Descriptor(Descriptor &&other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    Descriptor &operator=(Descriptor &&other) noexcept {
        std::swap(fd_, other.fd_);
        return *this;
    }
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    int get() const { return fd_; }

  private:
    int fd_;
};

[[noreturn]] void fail(const std::string &what) {
    throw BridgeError(what + ": " + std::strerror(errno));
}

struct Client {
    Descriptor socket;
    Origin origin;
    std::string peer;
    SocketcandSession session;
    std::string out = {};  ///< from `sent` on still to be sent
    size_t sent = 0;
    Clock::time_point settled = {};  ///< frames only after that ...
    std::string held = {};           ///< ... until when they wait here
    bool reading = true, gone = false;
    uint32_t events = 0;
    uint64_t malformed_told = 0;

    size_t unsent() const { return out.size() - sent + held.size(); }
};

/// A SocketCAN interface and what could not be written to it yet.
struct Interface {
    std::string name;
    Descriptor socket;
    std::deque<can_frame> waiting = {};
    uint32_t overflowed = 0;  ///< frames that the kernel dropped, as last told
};

can_frame kernel_frame_of(const CanRecord &record) {
    can_frame frame = {};
    frame.can_id = record.id;
    frame.can_dlc = record.dlc;
    std::copy(record.data.begin(), record.data.end(), frame.data);
    return frame;
}

Descriptor listen_on(uint16_t port) {
    Descriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (listener.get() < 0) fail("no socket");
    int on = 1;
    ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    // Nobody from outside: the protocol knows no passwords.
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::bind(listener.get(), reinterpret_cast<sockaddr *>(&address), sizeof address) != 0 ||
        ::listen(listener.get(), BACKLOG) != 0)
        return Descriptor();
    return listener;
}

Descriptor open_interface(const std::string &name) {
    Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
    if (socket.get() < 0) fail("this kernel has no SocketCAN");
    sockaddr_can address = {};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(::if_nametoindex(name.c_str()));
    if (address.can_ifindex == 0) fail("no interface " + name);
    int bytes = SOCKET_BUFFER_BYTES, on = 1;
    if (::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0)
        ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    ::setsockopt(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
    if (::bind(socket.get(), reinterpret_cast<sockaddr *>(&address), sizeof address) != 0)
        fail("cannot open interface " + name);
    return socket;
}

}  // namespace

class Bridge::Loop {
  public:
    explicit Loop(const Settings &settings);
    ~Loop();

    uint16_t port() const { return port_; }
    void publish(std::span<const CanRecord> frames);
    std::vector<Request> take();
    Counts counts() const {
        std::lock_guard lock(mutex_);
        return counts_;
    }
    size_t clients() const {
        std::lock_guard lock(mutex_);
        return connected_;
    }
    std::vector<std::string> notes() {
        std::lock_guard lock(mutex_);
        return std::exchange(notes_, {});
    }

  private:
    struct Outgoing {
        CanRecord record;
        Origin origin;
    };
    struct Remembered {
        CanFrame frame;
        Origin origin;
    };

    void open_server();
    void run();
    int wait_ms() const;
    void wake();
    void watch(int fd, uint32_t events, bool again);
    void note(const std::string &text);

    void accept_clients();
    void read(Client &client);
    void give_frames(Client &client, const std::vector<CanFrame> &frames);
    void write(Client &client);
    void release_held(Client &client);
    void adjust(Client &client);
    void drop(Client &client, const std::string &reason);
    void forget_gone();

    void distribute();
    void distribute(const Outgoing &outgoing);
    void read(uint32_t bus);
    void write(uint32_t bus);
    void accept(uint32_t bus, Origin origin, const CanFrame &frame);

    Settings settings_;
    uint16_t port_ = 0;
    Descriptor epoll_, wake_, listener_;
    std::vector<Interface> interfaces_;
    std::map<int, Client> clients_;  ///< by descriptor
    Origin next_client_ = FIRST_CLIENT;
    std::vector<Outgoing> batch_;  ///< being distributed

    mutable std::mutex mutex_;  ///< guards all that follows
    bool stopping_ = false;
    std::vector<Outgoing> outgoing_;
    std::vector<Request> incoming_;
    std::vector<std::deque<Remembered>> remembered_;  ///< by bus: sent by whom
    std::map<Origin, size_t> pending_;                ///< frames of a client in `incoming_`
    Counts counts_;
    size_t connected_ = 0;
    std::vector<std::string> notes_;

    std::thread thread_;
};

Bridge::Loop::Loop(const Settings &settings)
    : settings_(settings),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      remembered_(settings.buses) {
    if (epoll_.get() < 0 || wake_.get() < 0) fail("no event queue");
    if (settings.interfaces.empty()) {
        open_server();
    } else {
        if (settings.interfaces.size() != settings.buses)
            throw BridgeError(
                "a SocketCAN interface is needed for each bus: " + std::to_string(settings.buses) +
                ", not " + std::to_string(settings.interfaces.size()));
        for (const auto &name : settings.interfaces)
            interfaces_.push_back({name, open_interface(name)});
        for (const auto &interface : interfaces_) watch(interface.socket.get(), EPOLLIN, false);
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

void Bridge::Loop::open_server() {
    uint32_t last =
        settings_.port == 0 ? 0 : std::min(settings_.port + settings_.more_ports, 65535);
    for (uint32_t port = settings_.port; port <= last && listener_.get() < 0; port++)
        listener_ = listen_on(static_cast<uint16_t>(port));
    if (listener_.get() < 0)
        fail("no port from " + std::to_string(settings_.port) + " to " + std::to_string(last) +
             " on 127.0.0.1 can be opened");
    sockaddr_in address = {};
    socklen_t size = sizeof address;
    ::getsockname(listener_.get(), reinterpret_cast<sockaddr *>(&address), &size);
    port_ = ntohs(address.sin_port);
    watch(listener_.get(), EPOLLIN, false);
}

// The simulation's side

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
            Origin origin = NOBODY;
            auto &remembered = remembered_[record.bus];
            CanFrame frame = {record.id, record.dlc, false, record.data};
            auto its = [&](const Remembered &r) { return r.frame == frame; };
            if (record.from_host != 0) {
                auto found = std::find_if(remembered.begin(), remembered.end(), its);
                if (found != remembered.end()) {
                    // Frames keep their order on the bus: those before it were lost.
                    origin = found->origin;
                    remembered.erase(remembered.begin(), found + 1);
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
    // Clients that had to wait may be read again.
    wake();
    return requests;
}

// The thread

void Bridge::Loop::wake() {
    uint64_t one = 1;
    // A full counter wakes as well.
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

/// How long nothing has to be done by itself.
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
        for (int i = 0; i < count; i++) {
            int fd = events[static_cast<size_t>(i)].data.fd;
            if (fd == wake_.get()) {
                uint64_t times;
                [[maybe_unused]] ssize_t got = ::read(fd, &times, sizeof times);
            } else if (fd == listener_.get()) {
                accept_clients();
            } else if (auto found = clients_.find(fd); found != clients_.end()) {
                read(found->second);
            }
        }
        for (uint32_t bus = 0; bus < interfaces_.size(); bus++) read(bus);
        distribute();
        for (auto &[fd, client] : clients_) {
            release_held(client);
            write(client);
            adjust(client);
        }
        forget_gone();
        for (uint32_t bus = 0; bus < interfaces_.size(); bus++) write(bus);
    }
}

void Bridge::Loop::distribute() {
    batch_.clear();
    {
        std::lock_guard lock(mutex_);
        batch_.swap(outgoing_);
    }
    for (const Outgoing &outgoing : batch_) distribute(outgoing);
}

void Bridge::Loop::distribute(const Outgoing &outgoing) {
    const CanRecord &record = outgoing.record;
    if (!interfaces_.empty()) {
        if (outgoing.origin == INTERFACE) return;  // it is there already
        auto &waiting = interfaces_[record.bus].waiting;
        if (waiting.size() < QUEUE_FRAMES) {
            waiting.push_back(kernel_frame_of(record));
            return;
        }
        std::lock_guard lock(mutex_);
        counts_.lost_outgoing++;
        return;
    }
    std::string text;
    for (auto &[fd, client] : clients_) {
        const SocketcandSession &session = client.session;
        bool wants = session.raw() && session.bus() == record.bus && !client.gone;
        if (!wants || client.origin == outgoing.origin) continue;
        if (text.empty())
            append_socketcand_frame(text, {record.id, record.dlc, false, record.data}, record.at_s);
        bool waits = !client.held.empty() || Clock::now() < client.settled;
        (waits ? client.held : client.out) += text;
        if (client.unsent() > settings_.client_bytes) write(client);
        if (client.unsent() > settings_.client_bytes) drop(client, "it reads too slowly");
    }
}

/// A frame from outside, for the simulation.
void Bridge::Loop::accept(uint32_t bus, Origin origin, const CanFrame &frame) {
    std::lock_guard lock(mutex_);
    if (incoming_.size() >= QUEUE_FRAMES) {
        counts_.lost_incoming++;
        return;
    }
    incoming_.push_back({bus, frame});
    pending_[origin]++;
    auto &remembered = remembered_[bus];
    remembered.push_back({frame, origin});
    if (remembered.size() > REMEMBERED) remembered.pop_front();
}

// Clients

void Bridge::Loop::accept_clients() {
    for (;;) {
        sockaddr_in address = {};
        socklen_t size = sizeof address;
        Descriptor socket(::accept4(listener_.get(), reinterpret_cast<sockaddr *>(&address), &size,
                                    SOCK_NONBLOCK | SOCK_CLOEXEC));
        if (socket.get() < 0) return;
        std::string peer = "client 127.0.0.1:" + std::to_string(ntohs(address.sin_port));
        {
            std::lock_guard lock(mutex_);
            counts_.clients++;
            if (clients_.size() >= settings_.clients) counts_.clients_dropped++;
        }
        if (clients_.size() >= settings_.clients) {
            note(peer + " turned away: there are " + std::to_string(clients_.size()) + " already");
            continue;
        }
        int on = 1;
        ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        int fd = socket.get();
        Client &client = clients_
                             .emplace(fd, Client{std::move(socket), next_client_++, peer,
                                                 SocketcandSession(settings_.buses)})
                             .first->second;
        client.out = SOCKETCAND_GREETING;
        client.events = EPOLLIN;
        watch(fd, client.events, false);
        write(client);
        std::lock_guard lock(mutex_);
        connected_++;
    }
}

void Bridge::Loop::read(Client &client) {
    char buffer[READ_BYTES];
    ssize_t got = client.reading ? ::recv(client.socket.get(), buffer, sizeof buffer, 0) : -1;
    // A client that is not being read may still hang up.
    if (!client.reading) {
        got = ::recv(client.socket.get(), buffer, 1, MSG_PEEK | MSG_DONTWAIT);
        if (got > 0) return;
    }
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
        client.gone = true;
        return;
    }
    if (got <= 0) return;
    bool was_raw = client.session.raw();
    // Whatever it says now, it has read our last answer.
    client.settled = Clock::time_point();
    std::vector<CanFrame> frames;
    client.session.feed({buffer, static_cast<size_t>(got)}, client.out, frames);
    if (client.session.raw() && !was_raw)
        client.settled = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                            std::chrono::duration<double>(settings_.settle_s));
    if (!client.session.raw()) client.held.clear();
    give_frames(client, frames);
}

void Bridge::Loop::give_frames(Client &client, const std::vector<CanFrame> &frames) {
    for (const CanFrame &frame : frames) accept(client.session.bus(), client.origin, frame);
    uint64_t malformed = client.session.malformed() - client.malformed_told;
    if (malformed == 0) return;
    std::lock_guard lock(mutex_);
    counts_.malformed += malformed;
    client.malformed_told += malformed;
}

void Bridge::Loop::release_held(Client &client) {
    if (client.held.empty() || Clock::now() < client.settled) return;
    client.out += client.held;
    client.held.clear();
}

void Bridge::Loop::write(Client &client) {
    while (!client.gone && client.sent < client.out.size()) {
        ssize_t put = ::send(client.socket.get(), client.out.data() + client.sent,
                             client.out.size() - client.sent, MSG_NOSIGNAL);
        if (put < 0) {
            if (errno != EAGAIN && errno != EINTR) client.gone = true;
            break;
        }
        client.sent += static_cast<size_t>(put);
    }
    // Half of it sent: not worth keeping.
    if (2 * client.sent >= client.out.size()) {
        client.out.erase(0, client.sent);
        client.sent = 0;
    }
    if (client.session.closing() && client.out.empty()) client.gone = true;
}

/// What to be woken for, and whether the client has to wait until the simulation takes its frames.
void Bridge::Loop::adjust(Client &client) {
    if (client.gone) return;
    if (client.unsent() > settings_.client_bytes) {
        drop(client, "it reads too slowly");
        return;
    }
    {
        std::lock_guard lock(mutex_);
        auto pending = pending_.find(client.origin);
        client.reading = pending == pending_.end() || pending->second < settings_.client_frames;
    }
    // Of one that is not read, only a broken connection is of interest, which is always told.
    uint32_t events = client.reading ? static_cast<uint32_t>(EPOLLIN) : 0;
    if (!client.out.empty()) events |= EPOLLOUT;
    if (events != client.events) watch(client.socket.get(), events, true);
    client.events = events;
}

void Bridge::Loop::drop(Client &client, const std::string &reason) {
    if (client.gone) return;
    client.gone = true;
    note(client.peer + " dropped: " + reason);
    std::lock_guard lock(mutex_);
    counts_.clients_dropped++;
}

void Bridge::Loop::forget_gone() {
    size_t gone = std::erase_if(clients_, [](const auto &entry) { return entry.second.gone; });
    std::lock_guard lock(mutex_);
    connected_ -= gone;
}

// SocketCAN

void Bridge::Loop::read(uint32_t bus) {
    Interface &interface = interfaces_[bus];
    can_frame frame;
    iovec vector = {&frame, sizeof frame};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(uint32_t))];
    for (;;) {
        msghdr message = {};
        message.msg_iov = &vector;
        message.msg_iovlen = 1;
        message.msg_control = control;
        message.msg_controllen = sizeof control;
        ssize_t got = ::recvmsg(interface.socket.get(), &message, 0);
        if (got < 0) return;
        const cmsghdr *told = CMSG_FIRSTHDR(&message);
        if (told != nullptr && told->cmsg_type == SO_RXQ_OVFL) {
            uint32_t overflowed;
            std::memcpy(&overflowed, CMSG_DATA(told), sizeof overflowed);
            std::lock_guard lock(mutex_);
            counts_.lost_incoming += overflowed - interface.overflowed;
            interface.overflowed = overflowed;
        }
        bool strange = got != sizeof frame || frame.can_id > CanFrame::ID_MAX ||
                       frame.can_dlc > CanFrame::DATA_MAX;
        if (strange) {  // 29 bits, remote, error
            std::lock_guard lock(mutex_);
            counts_.malformed++;
            continue;
        }
        CanFrame plain = {static_cast<uint16_t>(frame.can_id), frame.can_dlc};
        std::copy_n(frame.data, frame.can_dlc, plain.data.begin());
        accept(bus, INTERFACE, plain);
    }
}

void Bridge::Loop::write(uint32_t bus) {
    Interface &interface = interfaces_[bus];
    while (!interface.waiting.empty()) {
        const can_frame &frame = interface.waiting.front();
        ssize_t put = ::write(interface.socket.get(), &frame, sizeof frame);
        // The interface's own queue is full: it says so, but not when it has room again.
        if (put < 0 && (errno == ENOBUFS || errno == EAGAIN || errno == EINTR)) return;
        if (put < 0) {
            std::lock_guard lock(mutex_);
            counts_.lost_outgoing++;
        }
        interface.waiting.pop_front();
    }
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
