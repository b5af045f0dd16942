#include "simulation/recorder.h"

#include <algorithm>
#include <cstring>

namespace kilotwin {

void Samples::add_robot(const Pose &pose, uint8_t color, uint8_t site_under) {
    x_m.push_back(static_cast<float>(pose.position.x()));
    y_m.push_back(static_cast<float>(pose.position.y()));
    heading_rad.push_back(static_cast<float>(pose.heading));
    led.push_back(color);
    site.push_back(site_under);
}

void Overlaps::add(double fraction) {
    contacts_++;
    worst_ = std::max(worst_, fraction);
    classes_[static_cast<size_t>(
        std::min(fraction / CLASS, static_cast<double>(classes_.size() - 1)))]++;
}

double Overlaps::median() const {
    if (contacts_ == 0) return 0;
    uint64_t below = 0;
    size_t i = 0;
    while ((below += classes_[i]) * 2 < contacts_) i++;
    return static_cast<double>(i + 1) * CLASS;
}

uint64_t result_hash(const Samples &now) {
    uint64_t hash = 0xCBF29CE484222325u;
    auto take = [&hash](const void *data, size_t bytes) {
        for (size_t i = 0; i < bytes; i++)
            hash = (hash ^ static_cast<const uint8_t *>(data)[i]) * 0x100000001B3u;
    };
    for (size_t i = 0; i < now.led.size(); i++) {
        take(&now.x_m[i], sizeof(float));
        take(&now.y_m[i], sizeof(float));
        take(&now.heading_rad[i], sizeof(float));
        take(&now.led[i], 1);
    }
    return hash;
}

}  // namespace kilotwin
