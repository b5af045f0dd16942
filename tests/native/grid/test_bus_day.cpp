// A full bus for a day. `make check-long PIECES=bus-day` runs it: it takes minutes.
#include <doctest/doctest.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <map>
#include <random>

#include "grid/can_bus.h"

using namespace kilotwin;

namespace test_bus_day {

namespace {

/// Memory of this process that is in use.
long resident_bytes() {
    long pages = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> pages >> resident;
    return resident * sysconf(_SC_PAGESIZE);
}

}  // namespace

TEST_CASE("a full bus of 51 nodes loses no frame in 24 hours, and takes no more memory" *
          doctest::skip()) {
    constexpr uint32_t NODES = 51;
    constexpr size_t ON_THE_WAY = 8;
    constexpr Cycles HOUR = 3600 * CYCLES_PER_SECOND;
    CanBus bus({1e-4}, Chance(1), 0);
    for (uint32_t i = 0; i < NODES; i++) bus.attach({"node " + std::to_string(i), {}, 16});
    std::map<uint32_t, uint32_t> on_the_way;  // number of a frame, and its sender
    std::minstd_rand dice(1);
    uint32_t number = 0;
    bool all_taken = true, all_right = true;
    // Whatever arrives, the next node sends on: the bus never falls idle, and frames compete.
    auto send = [&](uint32_t node, Cycles at) {
        CanFrame frame = {static_cast<uint16_t>(1 + dice() % 2047),
                          static_cast<uint8_t>(4 + dice() % 5)};
        std::memcpy(frame.data.data(), &number, sizeof number);
        on_the_way[number++] = node;
        all_taken = bus.queue(node, at, frame) && all_taken;
    };
    for (uint32_t i = 0; i < ON_THE_WAY; i++) send(i, 0);
    long first_hour_bytes = 0;
    uint64_t arrived = 0;
    for (uint64_t hour = 1; hour <= 24; hour++) {
        bus.run(hour * HOUR, [&](const CanBus::Delivery &delivery) {
            uint32_t carried;
            std::memcpy(&carried, delivery.frame.data.data(), sizeof carried);
            const auto sent = on_the_way.find(carried);
            all_right = all_right && sent != on_the_way.end() && sent->second == delivery.sender &&
                        delivery.receivers->size() == NODES - 1;
            if (sent != on_the_way.end()) on_the_way.erase(sent);
            arrived++;
            send((delivery.sender + 1 + dice() % 7) % NODES, delivery.at);
        });
        if (hour == 1) first_hour_bytes = resident_bytes();
    }
    CHECK(all_taken);
    CHECK(all_right);
    const auto &counts = bus.counts();
    CHECK(counts.lost_queue_full + counts.lost_bus_off + counts.lost_dead == 0);
    CHECK(counts.frames == arrived);
    CHECK(on_the_way.size() == ON_THE_WAY);
    CHECK(arrived + ON_THE_WAY == number);
    CHECK(arrived > 150'000'000);
    CHECK(counts.error_frames > 10'000);
    CHECK(bus.load(24 * HOUR) > 0.999);
    CHECK(resident_bytes() - first_hour_bytes < 256 * 1024);
    MESSAGE(arrived, " frames, ", counts.error_frames, " sent again");
}

}  // namespace test_bus_day
