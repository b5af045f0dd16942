// The socketcand server of a Bridge, and its clients.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <string_view>

#include "grid/bridge_loop.h"

namespace kilotwin {

namespace {

constexpr size_t READ_BYTES = 16 * 1024;
constexpr int BACKLOG = 128;
constexpr std::string_view TOO_MANY = "< error too many clients >";

/// A socket that listens on 127.0.0.1; owns none if the port is taken.
Descriptor listen_on(uint16_t port) {
    Descriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (listener.get() < 0) fail("no socket");
    int on = 1;
    ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    // Not reachable from outside: the protocol has no passwords.
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (::bind(listener.get(), reinterpret_cast<sockaddr *>(&address), sizeof address) != 0 ||
        ::listen(listener.get(), BACKLOG) != 0)
        return Descriptor();
    return listener;
}

}  // namespace

/// Opens the first free port from `port` on; 0: any port.
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

/// Accepts or turns away all clients that wait at the port.
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
        }
        if (clients_.size() >= settings_.clients && !make_room()) {
            ::send(socket.get(), TOO_MANY.data(), TOO_MANY.size(), MSG_NOSIGNAL);
            note(peer + " turned away: there are " + std::to_string(clients_.size()) + " already");
            std::lock_guard lock(mutex_);
            counts_.clients_dropped++;
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

/// Drops the client that was connected longest of those that have subscribed to no bus; false:
/// there is none.
bool Bridge::Loop::make_room() {
    auto longest = clients_.end();
    for (auto at = clients_.begin(); at != clients_.end(); ++at)
        if (!at->second.session.raw() &&
            (longest == clients_.end() || at->second.origin < longest->second.origin))
            longest = at;
    if (longest == clients_.end()) return false;
    Client &client = longest->second;
    ::send(client.socket.get(), TOO_MANY.data(), TOO_MANY.size(), MSG_NOSIGNAL);
    drop(client, "it had subscribed to no bus, and another client came");
    clients_.erase(longest);
    std::lock_guard lock(mutex_);
    connected_--;
    return true;
}

void Bridge::Loop::read(Client &client) {
    char buffer[READ_BYTES];
    ssize_t got = client.reading ? ::recv(client.socket.get(), buffer, sizeof buffer, 0) : -1;
    // A client that is not being read may still hang up: looks, and leaves what it sent.
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
    // A command means that the client has read our last answer.
    client.settled = Clock::time_point();
    std::vector<CanFrame> frames;
    client.session.feed({buffer, static_cast<size_t>(got)}, client.out, frames);
    if (client.session.raw() && !was_raw)
        client.settled = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                            std::chrono::duration<double>(settings_.settle_s));
    if (!client.session.raw()) client.held.clear();
    enqueue_frames(client, frames);
}

void Bridge::Loop::enqueue_frames(Client &client, const std::vector<CanFrame> &frames) {
    for (const CanFrame &frame : frames) enqueue(client.session.bus(), client.origin, frame);
    uint64_t malformed = client.session.malformed() - client.malformed_counted;
    if (malformed == 0) return;
    std::lock_guard lock(mutex_);
    counts_.malformed += malformed;
    client.malformed_counted += malformed;
}

/// Frames held back for a client that has just subscribed follow once it has settled.
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
    // Moves the rest to the front once it is the smaller half.
    if (2 * client.sent >= client.out.size()) {
        client.out.erase(0, client.sent);
        client.sent = 0;
    }
    if (client.session.closing() && client.out.empty()) client.gone = true;
}

/// Sets the events the client is watched for. It is read no further while too many of its frames
/// wait for take().
void Bridge::Loop::update_interest(Client &client) {
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
    // With no events set, epoll still reports a broken connection.
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

/// Appends a frame to the output of every client of its bus but its origin. Its text is made once.
void Bridge::Loop::distribute_to_clients(const Outgoing &outgoing) {
    const CanRecord &record = outgoing.record;
    std::string text;
    for (auto &[fd, client] : clients_) {
        const SocketcandSession &session = client.session;
        bool subscribed = session.raw() && session.bus() == record.bus && !client.gone;
        if (!subscribed || client.origin == outgoing.origin) continue;
        if (text.empty())
            append_socketcand_frame(text, {record.id, record.dlc, false, record.data}, record.at_s);
        bool waits = !client.held.empty() || Clock::now() < client.settled;
        (waits ? client.held : client.out) += text;
        if (client.unsent() > settings_.client_bytes) write(client);
        if (client.unsent() > settings_.client_bytes) drop(client, "it reads too slowly");
    }
}

}  // namespace kilotwin
