#include "simulation/recorder.h"

namespace kilotwin {

void Samples::add_robot(const Pose &pose, uint8_t color, uint8_t site_under) {
    x_m.push_back(static_cast<float>(pose.position.x()));
    y_m.push_back(static_cast<float>(pose.position.y()));
    heading_rad.push_back(static_cast<float>(pose.heading));
    led.push_back(color);
    site.push_back(site_under);
}

// FNV-1a with its usual offset and prime.
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
