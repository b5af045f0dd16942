/// The socketcand protocol (ASCII over TCP), the server's side of one connection: what python-can's
/// interface "socketcand" and other clients speak. Pure: text in, text and frames out.
///
/// Every command stands between "<" and ">". After `< hi >` the client opens a bus,
/// `< open can0 >`, and asks for all its frames, `< rawmode >`; each is answered `< ok >`.
/// `< send ID LENGTH BYTES >` sends a frame and is not answered, `< echo >` answers itself,
/// `< bcmmode >` ends the frames. What is not understood is answered with an error in socketcand's
/// words and counted.
#ifndef KILOTWIN_GRID_SOCKETCAND_H
#define KILOTWIN_GRID_SOCKETCAND_H

#include <string>
#include <string_view>
#include <vector>

#include "base/can_frame.h"

namespace kilotwin {

constexpr std::string_view SOCKETCAND_GREETING = "< hi >";

/// Appends `< frame ID SECONDS BYTES >` to `text`. Before the run's beginning `at_s` is negative.
void append_socketcand_frame(std::string &text, const CanFrame &frame, double at_s);

class SocketcandSession {
  public:
    /// Longer commands are refused, so no client can fill the memory.
    static constexpr size_t COMMAND_MAX = 256;

    /// Buses are named can0 to can{buses - 1}.
    explicit SocketcandSession(size_t buses) : buses_(buses) {}

    /// Takes what came in, in pieces of any size; appends answers to `replies`, and frames for the
    /// bus() to `frames`. Takes nothing more once closing().
    void feed(std::string_view bytes, std::string &replies, std::vector<CanFrame> &frames);

    bool opened() const { return opened_; }
    uint32_t bus() const { return bus_; }
    /// The client wants every frame of its bus.
    bool raw() const { return raw_; }
    /// After the replies the connection is to be closed: it asked for a bus that is not there.
    bool closing() const { return closing_; }
    uint64_t malformed() const { return malformed_; }

  private:
    void obey(std::string_view command, std::string &replies, std::vector<CanFrame> &frames);
    void open(std::string_view name, std::string &replies);
    void refuse(std::string_view reason, std::string &replies);

    size_t buses_;
    std::string command_;  ///< what came of the next one, without its "<"
    bool inside_ = false, stray_ = false;
    bool opened_ = false, raw_ = false, closing_ = false;
    uint32_t bus_ = 0;
    uint64_t malformed_ = 0;
};

}  // namespace kilotwin

#endif
