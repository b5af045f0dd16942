/// The socketcand protocol (ASCII over TCP), the server's side of one connection, for python-can's
/// interface "socketcand" and other clients. Pure: text in, text and frames out.
///
/// Every command stands between "<" and ">". After the greeting `< hi >` the client opens a bus, `<
/// open can0 >`, and subscribes to its frames, `< rawmode >`; each is answered `< ok >`. `< send ID
/// LENGTH BYTES >` sends a frame and has no answer, `< echo >` answers itself, `< bcmmode >` ends
/// the subscription. Any other text is answered with an error in socketcand's words and counted.
#ifndef KILOTWIN_GRID_SOCKETCAND_H
#define KILOTWIN_GRID_SOCKETCAND_H

#include <string>
#include <string_view>
#include <vector>

#include "base/can_frame.h"

namespace kilotwin {

constexpr std::string_view SOCKETCAND_GREETING = "< hi >";

/// Appends `< frame ID SECONDS BYTES >` to `text`. `at_s` is rounded to microseconds; before the
/// begin of the experiment it is negative.
void append_socketcand_frame(std::string &text, const CanFrame &frame, double at_s);

/// State of one connection: what a client has opened and a command begun. Any bytes may come in;
/// memory is bounded by COMMAND_MAX.
class SocketcandSession {
  public:
    /// Longest command, in bytes without its brackets; longer ones are refused.
    static constexpr size_t COMMAND_MAX = 256;

    /// Buses are named can0 to can{buses - 1}.
    explicit SocketcandSession(size_t buses) : buses_(buses) {}

    /// Processes received bytes, in pieces of any size; appends answers to `replies`, and frames
    /// for bus() to `frames`. Ignores everything once closing().
    void feed(std::string_view bytes, std::string &replies, std::vector<CanFrame> &frames);

    /// A bus has been opened; bus() is its index.
    bool opened() const { return opened_; }
    uint32_t bus() const { return bus_; }
    /// The client has subscribed to the frames of its bus.
    bool raw() const { return raw_; }
    /// The connection is to be closed once the replies are sent: the bus does not exist.
    bool closing() const { return closing_; }
    /// Commands refused so far.
    uint64_t malformed() const { return malformed_; }

  private:
    void execute(std::string_view command, std::string &replies, std::vector<CanFrame> &frames);
    void open(std::string_view name, std::string &replies);
    void refuse(std::string_view reason, std::string &replies);

    size_t buses_;
    std::string command_;  ///< begin of the next one, without its "<"
    bool inside_ = false;  ///< behind a "<"
    bool stray_ = false;   ///< in text between commands, which was answered already
    bool opened_ = false, raw_ = false, closing_ = false;
    uint32_t bus_ = 0;
    uint64_t malformed_ = 0;
};

}  // namespace kilotwin

#endif
