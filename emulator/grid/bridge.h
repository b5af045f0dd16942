/// The bridge from the emulated CAN buses to programs outside: a socketcand server on 127.0.0.1, or
/// real SocketCAN interfaces.
///
/// The bridge runs in a thread of its own. It and the simulation exchange frames through bounded
/// queues, and neither ever waits for the other: publish() hands over frames that ended on the
/// buses, take() returns those that programs outside send.
///
/// - A client that reads too slowly is dropped when it is `client_bytes` behind: the others lose
/// nothing, the memory does not grow.
/// - A client that sends faster than the simulation takes is not read any further until it does.
/// - A frame that a client sends reaches the other clients once it has ended on its bus, and the
/// sender never: as with SocketCAN.
/// - Lost frames and malformed commands are counted; connections refused and dropped are in
///   notes().
#ifndef KILOTWIN_GRID_BRIDGE_H
#define KILOTWIN_GRID_BRIDGE_H

#include <chrono>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/can_frame.h"

namespace kilotwin {

/// No port, no such interface, no SocketCAN in this kernel: its text names the thing and the
/// reason.
struct BridgeError : std::runtime_error {
    using runtime_error::runtime_error;
};

class Bridge {
  public:
    /// The host's, whose can/bridge.py has the defaults.
    struct Settings {
        size_t buses;         ///< named can0 to can{buses - 1}
        uint16_t port;        ///< of the server; 0: any free one
        uint16_t more_ports;  ///< if the port is in use, try so many more behind it
        /// Instead of the server: a SocketCAN interface for each bus, in their order.
        std::vector<std::string> interfaces;
        size_t client_bytes;   ///< unsent text at which a client is dropped
        size_t client_frames;  ///< waiting for take() at which a client is read no further
        /// Clients at the same time. One more takes the place of one that has subscribed to no bus;
        /// if all have, it is turned away.
        size_t clients;
        /// A client gets no frames for so long after it has subscribed, unless it sends something
        /// first: python-can fails if one arrives together with the answer to its question.
        double settle_s;
    };

    /// Counted since the beginning.
    struct Counts {
        uint64_t published = 0;        ///< frames given to publish()
        uint64_t lost_outgoing = 0;    ///< of these not handed on: thread or interface overloaded
        uint64_t taken = 0;            ///< frames that take() gave
        uint64_t lost_incoming = 0;    ///< that an interface had no place for
        uint64_t malformed = 0;        ///< commands or frames not understood
        uint64_t clients = 0;          ///< that ever connected
        uint64_t clients_dropped = 0;  ///< since they were too slow or too many
    };

    /// A frame that a program outside sends.
    struct Request {
        uint32_t bus;
        CanFrame frame;
        std::chrono::steady_clock::time_point came;
    };

    /// Starts the thread. Throws BridgeError.
    explicit Bridge(const Settings &settings);
    /// Closes all connections.
    ~Bridge();
    Bridge(const Bridge &) = delete;
    Bridge &operator=(const Bridge &) = delete;

    /// The server's port; 0 if there is none.
    uint16_t port() const;

    /// Hands over frames that ended on the buses, in their order. Never waits.
    void publish(std::span<const CanRecord> frames);

    /// All frames that came in since the last call, in each client's order. Never waits.
    std::vector<Request> take();

    Counts counts() const;

    /// Clients connected now.
    size_t clients() const;

    /// News of clients since the last call, a line each for people.
    std::vector<std::string> notes();

  private:
    class Loop;
    std::unique_ptr<Loop> loop_;
};

}  // namespace kilotwin

#endif
