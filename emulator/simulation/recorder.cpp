#include "simulation/recorder.h"

namespace kilotwin {

void Samples::add_robot(const Pose &pose, uint8_t color, uint8_t site_under) {
    x_m.push_back(static_cast<float>(pose.position.x()));
    y_m.push_back(static_cast<float>(pose.position.y()));
    heading_rad.push_back(static_cast<float>(pose.heading));
    led.push_back(color);
    site.push_back(site_under);
}

void Samples::add_object(const Pose &pose) {
    object_x_m.push_back(static_cast<float>(pose.position.x()));
    object_y_m.push_back(static_cast<float>(pose.position.y()));
    object_heading_rad.push_back(static_cast<float>(pose.heading));
}

}  // namespace kilotwin
