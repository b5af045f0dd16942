/// The thread of a Bridge: one epoll loop over the socketcand server's clients, or over SocketCAN
/// interfaces. Private to bridge*.cpp.
///
/// All sockets belong to the thread and none of them blocks. What both threads touch lies behind
/// one mutex, which is held only to move frames and counts in and out.
#ifndef KILOTWIN_GRID_BRIDGE_LOOP_H
#define KILOTWIN_GRID_BRIDGE_LOOP_H

#include <linux/can.h>

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "grid/bridge.h"
#include "grid/descriptor.h"
#include "grid/socketcand.h"

namespace kilotwin {

using Clock = std::chrono::steady_clock;

/// Capacity of each queue: frames for the thread, for take(), or for an interface. Half a minute of
/// four full buses.
constexpr size_t QUEUE_FRAMES = 1 << 18;

/// Where a frame comes from: a client by its number, or one of these.
using Origin = uint64_t;
constexpr Origin SIMULATION = 0;
constexpr Origin INTERFACE = 1;  ///< a program at the SocketCAN interface
constexpr Origin FIRST_CLIENT = 2;

/// A connection to the socketcand server.
struct Client {
    Descriptor socket;
    Origin origin;     ///< its number
    std::string peer;  ///< address and port, for notes
    SocketcandSession session;
    std::string out = {};  ///< text to send; its first `sent` bytes are sent
    size_t sent = 0;
    Clock::time_point settled = {};  ///< frames are sent from then on ...
    std::string held = {};           ///< ... and are held back here before
    bool reading = true;             ///< false: it waits until the simulation takes its frames
    bool gone = false;               ///< to be forgotten at the end of this turn of the loop
    uint32_t events = 0;             ///< epoll events it is watched for
    uint64_t malformed_counted = 0;  ///< of session.malformed(), how many are in the counts

    /// Bytes of text that the client has not taken yet.
    size_t unsent() const { return out.size() - sent + held.size(); }
};

/// A SocketCAN interface, and the frames that it had no room for yet.
struct Interface {
    std::string name;
    Descriptor socket;
    std::deque<can_frame> waiting = {};
    uint32_t overflowed = 0;  ///< frames that the kernel has dropped so far (SO_RXQ_OVFL)
};

/// The implementation behind Bridge.
class Bridge::Loop {
  public:
    /// Opens the server or the interfaces, and starts the thread. Throws BridgeError.
    explicit Loop(const Settings &settings);
    /// Ends the thread and closes everything.
    ~Loop();

    // For the simulation's thread; see Bridge.
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
    /// A frame that ended on a bus, to be handed to everything outside but its origin.
    struct Outgoing {
        CanRecord record;
        Origin origin;
    };
    /// A frame from outside that has not yet ended on its bus.
    struct Echo {
        CanFrame frame;
        Origin origin;
    };

    /// The thread: waits, reads, distributes, writes, until it is stopped.
    void run();
    void dispatch(int fd);
    int wait_ms() const;
    /// Ends the thread's present wait.
    void wake();
    /// Adds a descriptor to epoll, or (`again`) changes its events.
    void watch(int fd, uint32_t events, bool again);
    /// Adds a line to notes(), unless these are too many.
    void note(const std::string &text);

    // The socketcand server and its clients (bridge_clients.cpp).
    void open_server();
    /// Accepts or turns away all that wait.
    void accept_clients();
    bool make_room();
    /// Receives and executes commands of a client.
    void read(Client &client);
    void enqueue_frames(Client &client, const std::vector<CanFrame> &frames);
    /// Sends what the client has room for.
    void write(Client &client);
    void release_held(Client &client);
    /// Sets the events that a client is watched for, and drops it if it is too far behind.
    void update_interest(Client &client);
    /// Disconnects a client and notes why.
    void drop(Client &client, const std::string &reason);
    /// Closes and removes the clients that are gone.
    void forget_gone();

    void distribute_to_clients(const Outgoing &outgoing);

    // SocketCAN interfaces (bridge_interfaces.cpp).
    /// Opens one for each bus. Throws BridgeError.
    void open_interfaces();
    void distribute_to_interface(const Outgoing &outgoing);
    void read(uint32_t bus);
    void write(uint32_t bus);

    /// Hands the frames of publish() on to everything outside.
    void distribute();
    /// Queues a frame from outside for take().
    void enqueue(uint32_t bus, Origin origin, const CanFrame &frame);

    Settings settings_;
    uint16_t port_ = 0;
    Descriptor epoll_, wake_, listener_;
    std::vector<Interface> interfaces_;
    std::map<int, Client> clients_;  ///< by descriptor
    Origin next_client_ = FIRST_CLIENT;
    std::vector<Outgoing> batch_;  ///< the frames of one distribute()

    mutable std::mutex mutex_;  ///< guards all that follows
    bool stopping_ = false;
    std::vector<Outgoing> outgoing_;        ///< from publish()
    std::vector<Request> incoming_;         ///< for take()
    std::vector<std::deque<Echo>> echoes_;  ///< by bus, in order of arrival
    std::map<Origin, size_t> pending_;      ///< frames in `incoming_`, by client
    Counts counts_;
    size_t connected_ = 0;
    std::vector<std::string> notes_;

    std::thread thread_;
};

}  // namespace kilotwin

#endif
