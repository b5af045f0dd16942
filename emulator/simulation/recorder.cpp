#include "simulation/recorder.h"

namespace kilotwin {

void Samples::add_robot(const Pose &pose, uint8_t color, uint8_t site_under) {
    x_m.push_back(static_cast<float>(pose.position.x()));
    y_m.push_back(static_cast<float>(pose.position.y()));
    heading_rad.push_back(static_cast<float>(pose.heading));
    led.push_back(color);
    site.push_back(site_under);
}

void Samples::add_motors(uint8_t left, uint8_t right) {
    left_duty.push_back(left);
    right_duty.push_back(right);
}

void Samples::add_messages(const FrameCounts &counts, uint32_t taken) {
    sent.push_back(counts.sent);
    received.push_back(counts.received);
    delivered.push_back(taken);
}

void Samples::add_object(const Pose &pose) {
    object_x_m.push_back(static_cast<float>(pose.position.x()));
    object_y_m.push_back(static_cast<float>(pose.position.y()));
    object_heading_rad.push_back(static_cast<float>(pose.heading));
}

}  // namespace kilotwin
