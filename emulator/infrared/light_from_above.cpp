#include "infrared/light_from_above.h"

#include <algorithm>

#include "infrared/kilobot_channel.h"
#include "robots/inbox.h"

namespace kilotwin {

void LightFromAbove::add(const message_t &message, Cycles at, uint32_t controller) {
    insert_by_time(controllers_[controller].waiting, {at, message});
}

Cycles LightFromAbove::Controller::next() const {
    return waiting.empty() ? NEVER : std::max(waiting.front().at, free_at);
}

size_t LightFromAbove::soonest() const {
    const auto sooner = [](const Controller &a, const Controller &b) {
        return a.next() < b.next();
    };
    return static_cast<size_t>(std::min_element(controllers_.begin(), controllers_.end(), sooner) -
                               controllers_.begin());
}

// Carrier sense is passed over: a controller does not listen, so its frames are granted.
void LightFromAbove::begin_next() {
    const size_t which = soonest();
    Controller &controller = controllers_[which];
    const Cycles at = controller.next();
    const message_t message = controller.waiting.front().message;
    controller.waiting.pop_front();
    controller.free_at = at + FRAME_CYCLES;
    channel_.begin_frame(first_ + static_cast<uint32_t>(which), at, message, true);
}

// All robots that it covers see it equally well. It may say RUN.
void LightFromAbove::shine(Frame &frame) {
    frame.above = ++begun_;
    frame.has_orders = true;
    for (uint32_t robot = 0; robot < channel_.robots(); robot++)
        if (channel_.is_covered(robot, frame.sender - first_))
            channel_.shine_on_robot(frame, robot, 0);
}

void LightFromAbove::sent(const Frame &frame) {
    channel_.tally().above_sent++;
    channel_.tally().above_reached += frame.reached.size();
}

}  // namespace kilotwin
