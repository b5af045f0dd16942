// The SocketCAN interfaces of a Bridge.
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstring>

#include "grid/bridge_loop.h"

namespace kilotwin {

namespace {

// Linux grants at most twice the system's limit, unless the process is privileged.
constexpr int SOCKET_BUFFER_BYTES = 8 << 20;

can_frame kernel_frame_of(const CanRecord &record) {
    can_frame frame = {};
    frame.can_id = record.id;
    frame.can_dlc = record.dlc;
    std::copy(record.data.begin(), record.data.end(), frame.data);
    return frame;
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

void Bridge::Loop::open_interfaces() {
    if (settings_.interfaces.size() != settings_.buses)
        throw BridgeError(
            "a SocketCAN interface is needed for each bus: " + std::to_string(settings_.buses) +
            ", not " + std::to_string(settings_.interfaces.size()));
    for (const auto &name : settings_.interfaces)
        interfaces_.push_back({name, open_interface(name)});
    for (const auto &interface : interfaces_) watch(interface.socket.get(), EPOLLIN, false);
}

void Bridge::Loop::distribute_to_interface(const Outgoing &outgoing) {
    const CanRecord &record = outgoing.record;
    if (outgoing.origin == INTERFACE) return;  // it came from there
    auto &waiting = interfaces_[record.bus].waiting;
    if (waiting.size() < QUEUE_FRAMES) {
        waiting.push_back(kernel_frame_of(record));
        return;
    }
    std::lock_guard lock(mutex_);
    counts_.lost_outgoing++;
}

/// Takes all frames in from an interface, and the kernel's count of those it dropped.
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
        const cmsghdr *ancillary = CMSG_FIRSTHDR(&message);
        if (ancillary != nullptr && ancillary->cmsg_type == SO_RXQ_OVFL) {
            uint32_t overflowed;
            std::memcpy(&overflowed, CMSG_DATA(ancillary), sizeof overflowed);
            std::lock_guard lock(mutex_);
            counts_.lost_incoming += overflowed - interface.overflowed;
            interface.overflowed = overflowed;
        }
        bool unsupported = got != sizeof frame || frame.can_id > CanFrame::ID_MAX ||
                           frame.can_dlc > CanFrame::DATA_MAX;
        if (unsupported) {  // 29-bit identifier, remote frame, error frame
            std::lock_guard lock(mutex_);
            counts_.malformed++;
            continue;
        }
        CanFrame plain = {static_cast<uint16_t>(frame.can_id), frame.can_dlc};
        std::copy_n(frame.data, frame.can_dlc, plain.data.begin());
        enqueue(bus, INTERFACE, plain);
    }
}

/// Writes waiting frames to an interface until it has no more room.
void Bridge::Loop::write(uint32_t bus) {
    Interface &interface = interfaces_[bus];
    while (!interface.waiting.empty()) {
        const can_frame &frame = interface.waiting.front();
        ssize_t put = ::write(interface.socket.get(), &frame, sizeof frame);
        // The interface's own queue is full: tried again after RETRY.
        if (put < 0 && (errno == ENOBUFS || errno == EAGAIN || errno == EINTR)) return;
        if (put < 0) {
            std::lock_guard lock(mutex_);
            counts_.lost_outgoing++;
        }
        interface.waiting.pop_front();
    }
}

}  // namespace kilotwin
