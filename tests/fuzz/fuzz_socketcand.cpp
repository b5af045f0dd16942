/// Fuzz target: a client of the bridge that says anything, in any pieces.
#include <cassert>
#include <cstddef>
#include <cstdint>

#include "grid/socketcand.h"

using namespace kilotwin;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size) {
    if (size == 0) return 0;
    std::string_view text(reinterpret_cast<const char *>(input) + 1, size - 1);
    size_t piece = 1 + input[0];
    SocketcandSession whole(4), cut(4);
    std::string replies, cut_replies;
    std::vector<CanFrame> frames, cut_frames;
    whole.feed(text, replies, frames);
    for (size_t i = 0; i < text.size(); i += piece)
        cut.feed(text.substr(i, piece), cut_replies, cut_frames);
    assert(replies == cut_replies && frames == cut_frames);
    assert(whole.malformed() == cut.malformed() && whole.bus() < 4);
    assert(frames.empty() || whole.opened());
    for (const CanFrame &frame : frames) {
        assert(frame.id <= CanFrame::ID_MAX && frame.dlc <= CanFrame::DATA_MAX);
        std::string written;
        append_socketcand_frame(written, frame, 1.5);
        assert(written.size() <= 64);
    }
    return 0;
}
