/// Messages as pulses of light and back; the layout is that of kilolib/core/infrared_frame.h.
#ifndef KILOTWIN_INFRARED_INFRARED_PULSES_H
#define KILOTWIN_INFRARED_INFRARED_PULSES_H

#include <cstdint>
#include <vector>

#include "base/clock.h"
#include "kilolib.h"

namespace kilotwin {

/// When the pulses of a frame begin, from its first on.
std::vector<Cycles> pulses_of(const message_t &message);

/// Follows the pulses of one sender and finds the frames in them.
class PulseReader {
  public:
    /// No pulse for so long: what was begun is over.
    static constexpr Cycles SILENCE = BYTE_TIMEOUT;

    enum class Found : uint8_t {
        NOTHING,   ///< the frame goes on
        BEGIN,     ///< this pulse begins a frame
        MESSAGE,   ///< this pulse completes message()
        NONSENSE,  ///< this pulse fits no frame; it is over
    };

    /// A pulse begins at `at`. Times must not decrease.
    Found pulse(Cycles at);

    /// Whether what was begun is over at `at`, for want of pulses: an attempt given up, a frame
    /// torn off.
    bool torn_off(Cycles at) const { return reading_ && at >= last_ + SILENCE; }

    /// Forgets what was begun.
    void reset() { reading_ = false; }

    bool reading() const { return reading_; }  ///< between the first pulse of a frame and its end
    /// When the frame that it is reading, or has read last, began.
    Cycles begun_at() const { return begun_at_; }
    /// The last complete message, whatever its CRC.
    const message_t &message() const { return message_; }

  private:
    bool reading_ = false;
    bool in_byte_ = false;  ///< between a start and a stop pulse
    Cycles begun_at_ = 0, byte_at_ = 0, last_ = 0;
    unsigned bytes_ = 0;  ///< complete, with the leader
    uint8_t value_ = 0;
    message_t message_ = {};
};

}  // namespace kilotwin

#endif
