#include "infrared/light_from_above.h"

#include <algorithm>

#include "infrared/kilobot_channel.h"
#include "robots/inbox.h"

namespace kilotwin {

void LightFromAbove::add(const message_t &message, Cycles at) {
    insert_by_time(waiting_, {at, message});
}

Cycles LightFromAbove::next() const {
    return waiting_.empty() ? NEVER : std::max(waiting_.front().at, free_at_);
}

// Carrier sense is passed over: a controller does not listen, so its frames are granted.
void LightFromAbove::begin_next() {
    const Cycles at = next();
    const message_t message = waiting_.front().message;
    waiting_.pop_front();
    free_at_ = at + FRAME_CYCLES;
    channel_.begin_frame(station_, at, message, true);
}

// All robots see it equally well, wherever they are. It may say RUN.
void LightFromAbove::shine(Frame &frame) {
    frame.above = ++begun_;
    frame.has_orders = true;
    for (uint32_t robot = 0; robot < channel_.robots(); robot++)
        channel_.shine_on_robot(frame, robot, 0);
}

void LightFromAbove::sent(const Frame & /*frame*/) { channel_.tally().above_sent++; }

}  // namespace kilotwin
