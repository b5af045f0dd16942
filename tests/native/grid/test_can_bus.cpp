#include <doctest/doctest.h>

#include <cmath>
#include <deque>
#include <map>
#include <random>

#include "grid/can_bus.h"

using namespace kilotwin;

namespace test_can_bus {

namespace {

constexpr Cycles BIT = CAN_BIT_CYCLES, GAP = CAN_INTERMISSION_BITS * BIT;
constexpr Cycles RECOVERY = 128 * 11 * BIT;

CanFrame frame_of(uint16_t id, uint8_t dlc = 8, uint8_t fill = 0x55) {
    CanFrame frame = {id, dlc};
    for (size_t i = 0; i < dlc; i++) frame.data[i] = fill;
    return frame;
}

Cycles length(const CanFrame &frame) { return can_frame_bits(frame) * BIT; }

struct Arrived {
    Cycles begin, at;
    uint32_t sender;
    uint16_t id;
    uint8_t first;
    std::vector<uint32_t> receivers;
    bool operator==(const Arrived &) const = default;
};

/// A bus with `nodes` that take everything, and all that arrives on it.
struct Bench {
    CanBus bus;
    std::vector<Arrived> log;

    explicit Bench(size_t nodes = 2, double error_share = 0, uint64_t seed = 1)
        : bus({error_share}, Chance(seed), 0) {
        for (size_t i = 0; i < nodes; i++) bus.attach({"node " + std::to_string(i), {}, 64});
    }
    void run(Cycles until) {
        bus.run(until, [&](const CanBus::Delivery &d) {
            log.push_back({d.begin, d.at, d.sender, d.frame.id, d.frame.data[0], *d.receivers});
        });
    }
    std::vector<uint16_t> ids() const {
        std::vector<uint16_t> ids;
        for (const auto &arrived : log) ids.push_back(arrived.id);
        return ids;
    }
};

uint64_t lost(const CanBus &bus) {
    const auto &counts = bus.counts();
    return counts.lost_queue_full + counts.lost_bus_off + counts.lost_dead;
}

}  // namespace

TEST_CASE("a frame on a free bus begins at once and ends after its bits") {
    Bench bench;
    CHECK(bench.bus.queue(0, 1000, frame_of(0x43)));
    Cycles end = 1000 + length(frame_of(0x43));
    CHECK(bench.bus.next() == end);
    bench.run(end);
    CHECK(bench.log.empty());
    bench.run(end + 1);
    REQUIRE(bench.log.size() == 1);
    CHECK(bench.log[0] == Arrived{1000, end, 0, 0x43, 0x55, {1}});
    CHECK(bench.bus.next() == NEVER);
}

TEST_CASE(
    "the lowest identifier goes first, then the lowest node, and no node interrupts a frame") {
    Bench bench(5);
    bench.bus.queue(4, 100, frame_of(0x300));
    bench.bus.queue(3, 200, frame_of(0x200));
    bench.bus.queue(2, 200, frame_of(0x200));
    bench.bus.queue(1, 200, frame_of(0x201));
    bench.bus.queue(0, 200, frame_of(0x000));
    bench.run(CYCLES_PER_SECOND);
    CHECK(bench.ids() == std::vector<uint16_t>{0x300, 0x000, 0x200, 0x200, 0x201});
    CHECK(bench.log[2].sender == 2);
    CHECK(bench.log[3].sender == 3);
    for (size_t i = 1; i < bench.log.size(); i++)
        CHECK(bench.log[i].begin == bench.log[i - 1].at + GAP);
}

TEST_CASE("a node sends its own frames in the order in which it queued them") {
    Bench bench;
    for (uint16_t id : {5, 3, 9, 1}) bench.bus.queue(0, 0, frame_of(id));
    bench.run(CYCLES_PER_SECOND);
    CHECK(bench.ids() == std::vector<uint16_t>{5, 3, 9, 1});
}

TEST_CASE("a node that queues while a frame ends takes part in the next arbitration") {
    Bench bench(3);
    bench.bus.queue(0, 0, frame_of(0x100));
    bench.bus.queue(0, 0, frame_of(0x200));
    bench.bus.run(CYCLES_PER_SECOND, [&](const CanBus::Delivery &delivery) {
        bench.log.push_back({0, delivery.at, delivery.sender, delivery.frame.id, 0, {}});
        // Within the intermission, and just too late.
        if (delivery.frame.id == 0x100) bench.bus.queue(1, delivery.at + GAP, frame_of(0x020));
        if (delivery.frame.id == 0x020) bench.bus.queue(1, delivery.at + GAP + 1, frame_of(0x021));
    });
    CHECK(bench.ids() == std::vector<uint16_t>{0x100, 0x020, 0x200, 0x021});
}

TEST_CASE("frames reach the nodes whose filters let them through, and never their sender") {
    CanBus bus({}, Chance(1), 0);
    bus.attach({"host", {{0x001, 0x001}}, 16});
    bus.attach({"(0, 0)", {{0x000, 0x7FF}, {0x040, 0x7FF}, {0x042, 0x7FF}}, 16});
    bus.attach({"(1, 0)", {{0x000, 0x7FF}, {0x040, 0x7FF}, {0x044, 0x7FF}}, 16});
    std::map<uint16_t, std::vector<uint32_t>> receivers;
    for (uint16_t id : {0x000, 0x040, 0x042, 0x044, 0x046}) bus.queue(0, 0, frame_of(id));
    bus.queue(1, 0, frame_of(0x043));
    bus.queue(2, 0, frame_of(0x040));
    bus.run(CYCLES_PER_SECOND, [&](const CanBus::Delivery &delivery) {
        if (delivery.sender == 2) CHECK(*delivery.receivers == std::vector<uint32_t>{1});
        if (delivery.sender != 2) receivers[delivery.frame.id] = *delivery.receivers;
    });
    CHECK(receivers[0x000] == std::vector<uint32_t>{1, 2});
    CHECK(receivers[0x040] == std::vector<uint32_t>{1, 2});
    CHECK(receivers[0x042] == std::vector<uint32_t>{1});
    CHECK(receivers[0x044] == std::vector<uint32_t>{2});
    CHECK(receivers[0x046].empty());
    CHECK(receivers[0x043] == std::vector<uint32_t>{0});
}

TEST_CASE("a queue takes as many frames as it has places, and what it refuses is counted") {
    CanBus bus({}, Chance(1), 0);
    bus.attach({"small", {}, 3});
    bus.attach({"other", {}, 3});
    for (int i = 0; i < 3; i++) CHECK(bus.queue(0, 0, frame_of(1)));
    CHECK_FALSE(bus.queue(0, 0, frame_of(1)));
    CHECK(bus.queued(0) == 3);
    int arrived = 0;
    bus.run(CYCLES_PER_SECOND, [&](const CanBus::Delivery &) {
        // A place is free as soon as a frame has ended.
        if (arrived++ == 0) CHECK(bus.queue(0, CYCLES_PER_SECOND / 2, frame_of(1)));
    });
    CHECK(bus.counts().lost_queue_full == 1);
    CHECK(bus.counts().frames == 4);
}

TEST_CASE("a full bus for an hour loses nothing and carries exactly what 250 kbit/s allow") {
    constexpr uint32_t NODES = 112;
    constexpr Cycles HOUR = 3600 * CYCLES_PER_SECOND;
    CanBus bus({}, Chance(1), 0);
    bus.attach({"host", {{1, 1}}, 16});
    // All modules together want all of the wire: each sends one frame a round.
    Cycles round = 0;
    std::vector<CanFrame> frames(NODES + 1);
    for (uint32_t i = 1; i <= NODES; i++) {
        bus.attach({"module", {{static_cast<uint16_t>(i << 1), 0x7FF}}, 4});
        frames[i] =
            frame_of(static_cast<uint16_t>(i << 6 | i % 31 << 1 | 1), 8, static_cast<uint8_t>(i));
        frames[i].id &= CanFrame::ID_MAX;
        round += length(frames[i]) + GAP;
    }
    for (uint32_t i = 1; i <= NODES; i++) bus.queue(i, 0, frames[i]);
    std::vector<uint64_t> sent(NODES + 1);
    Cycles last = 0;
    bus.run(HOUR, [&](const CanBus::Delivery &delivery) {
        sent[delivery.sender]++;
        // Without a pause: the bus is never free.
        if (delivery.begin != last) FAIL("the bus was free for a while");
        last = delivery.at + GAP;
        bus.queue(delivery.sender, round * sent[delivery.sender], frames[delivery.sender]);
    });
    uint64_t total = 0;
    for (uint32_t i = 1; i <= NODES; i++) {
        total += sent[i];
        CHECK(sent[i] >= HOUR / round);
        CHECK(sent[i] <= HOUR / round + 1);
    }
    CHECK(bus.counts().frames == total);
    CHECK(lost(bus) == 0);
    CHECK(bus.counts().busy == last);
    CHECK(HOUR - last < 160 * BIT);
    CHECK(bus.load(last) == 1.0);
    for (uint32_t i = 1; i <= NODES; i++) CHECK(bus.queued(i) <= 1);
}

TEST_CASE("the order of frames is that of a plain model with as many lists as nodes") {
    std::mt19937 random(7);
    for (int round = 0; round < 200; round++) {
        Bench bench(6);
        struct Wish {
            Cycles at;
            CanFrame frame;
        };
        std::vector<std::deque<Wish>> wishes(6);
        for (auto &list : wishes) {
            Cycles at = 0;
            for (int i = 0; i < 8; i++) {
                at += random() % (10 * length(frame_of(0)));
                list.push_back({at, frame_of(static_cast<uint16_t>(random() % 64),
                                             static_cast<uint8_t>(random() % 9))});
            }
        }
        for (uint32_t node = 0; node < 6; node++)
            for (const auto &wish : wishes[node]) bench.bus.queue(node, wish.at, wish.frame);
        bench.run(CYCLES_PER_SECOND);
        Cycles free = 0;
        for (const auto &arrived : bench.log) {
            Cycles begin = NEVER;
            for (const auto &list : wishes)
                if (!list.empty()) begin = std::min(begin, std::max(list.front().at, free));
            std::pair<uint16_t, uint32_t> best = {0xFFFF, 0};
            for (uint32_t node = 0; node < 6; node++)
                if (!wishes[node].empty() && wishes[node].front().at <= begin)
                    best = std::min(best, {wishes[node].front().frame.id, node});
            REQUIRE(arrived.begin == begin);
            REQUIRE(arrived.sender == best.second);
            free = arrived.at + GAP;
            wishes[best.second].pop_front();
        }
        for (const auto &list : wishes) REQUIRE(list.empty());
    }
}

TEST_CASE("results do not depend on how the time is cut") {
    auto play = [](uint64_t seed, Cycles slice) {
        Bench bench(8, 0.1, seed);
        std::mt19937 random(3);
        std::vector<std::pair<Cycles, uint32_t>> wishes;
        for (int i = 0; i < 400; i++)
            wishes.emplace_back(random() % (CYCLES_PER_SECOND / 2), random() % 8);
        std::sort(wishes.begin(), wishes.end());
        size_t next = 0;
        for (Cycles at = 0; at < CYCLES_PER_SECOND; at += slice) {
            for (; next < wishes.size() && wishes[next].first < at + slice; next++)
                bench.bus.queue(wishes[next].second, wishes[next].first,
                                frame_of(static_cast<uint16_t>(wishes[next].first % 2000)));
            bench.run(at + slice);
        }
        return bench.log;
    };
    auto whole = play(1, CYCLES_PER_SECOND);
    CHECK(whole.size() == 400);
    CHECK(play(1, CYCLES_PER_SECOND) == whole);
    CHECK(play(1, 1000) == whole);
    CHECK(play(1, 77'777) == whole);
    CHECK(play(2, CYCLES_PER_SECOND) != whole);
}

TEST_CASE("as many attempts are disturbed as the settings say, and every frame arrives") {
    Bench bench(3, 0.05);
    constexpr uint64_t FRAMES = 40'000;
    for (uint64_t i = 0; i < FRAMES; i++) {
        Cycles at = i * 200 * BIT;
        bench.bus.queue(i % 2, at, frame_of(0x100));
        bench.run(at + 100 * BIT);
    }
    bench.run(FRAMES * 400 * BIT);
    const auto &counts = bench.bus.counts();
    CHECK(counts.frames == FRAMES);
    CHECK(lost(bench.bus) == 0);
    double attempts = static_cast<double>(counts.frames + counts.error_frames);
    double share = static_cast<double>(counts.error_frames) / attempts;
    CHECK(std::abs(share - 0.05) < 5 * std::sqrt(0.05 * 0.95 / attempts));
    // One error adds 8, a frame takes away 1: far from any limit.
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_ACTIVE);
    CHECK(counts.went_bus_off == 0);
}

TEST_CASE(
    "disturbed attempts end anywhere within the frame, and cost their bits and an error frame") {
    Bench bench(2, 0.5, 4);
    const Cycles whole = length(frame_of(0x100));
    std::vector<double> wasted;
    Cycles at = 0;
    for (int i = 0; i < 4000; i++) {
        auto errors = bench.bus.counts().error_frames;
        bench.bus.queue(0, at, frame_of(0x100));
        bench.run(at + 40 * whole);
        REQUIRE(!bench.log.empty());
        if (bench.bus.counts().error_frames == errors + 1) {
            Cycles before = bench.log.back().begin - at;
            wasted.push_back(static_cast<double>(before) / BIT);
        }
        at += 40 * whole + 2 * RECOVERY;
        bench.run(at);
        if (bench.bus.transmit_errors(0) > 100) {
            bench.bus.kill(0, at);
            bench.bus.recover(0, at);
        }
    }
    double bits = static_cast<double>(whole) / BIT, sum = 0;
    for (double w : wasted) {
        CHECK(w >= 1 + 20 + 3);
        CHECK(w <= bits + 20 + 3);
        sum += w;
    }
    // Uniform over the frame's bits: mean and its standard error.
    double n = static_cast<double>(wasted.size());
    CHECK(n > 500);
    CHECK(std::abs(sum / n - ((bits + 1) / 2 + 23)) < 5 * bits / std::sqrt(12 * n));
}

TEST_CASE("32 errors in a row take a node bus-off, and 128 times 11 recessive bits bring it back") {
    Bench bench(3, 1.0);
    for (int i = 0; i < 3; i++) bench.bus.queue(0, 0, frame_of(0x100));
    bench.run(100'000 * BIT);
    CHECK(bench.bus.counts().error_frames == 32);
    CHECK(bench.bus.counts().went_bus_off == 1);
    CHECK(bench.bus.counts().lost_bus_off == 3);
    CHECK(bench.bus.counts().frames == 0);
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_ACTIVE);
    CHECK(bench.bus.transmit_errors(0) == 0);
    // The others count one each time, and get rid of it by what they receive without an error.
    CHECK(bench.bus.receive_errors(1) == 32);
}

TEST_CASE("a bus-off node neither sends nor receives until it has recovered") {
    Bench bench(3);
    bench.run(1000);
    bench.bus.bus_off(0, 1000);
    CHECK(bench.bus.state(0) == CanBus::State::BUS_OFF);
    CHECK_FALSE(bench.bus.queue(0, 1000, frame_of(0x100)));
    CHECK(bench.bus.counts().lost_bus_off == 1);
    bench.bus.queue(1, 1000, frame_of(0x200));
    bench.run(1000 + RECOVERY / 2);
    REQUIRE(bench.log.size() == 1);
    CHECK(bench.log[0].receivers == std::vector<uint32_t>{2});
    bench.run(1000 + 2 * RECOVERY);
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_ACTIVE);
    CHECK(bench.bus.queue(0, 1000 + 2 * RECOVERY, frame_of(0x100)));
    bench.run(1000 + 3 * RECOVERY);
    CHECK(bench.log.back().id == 0x100);
}

TEST_CASE("recovery takes exactly 128 times 11 bits of a free bus, and a frame's end counts once") {
    Bench free(2);
    free.bus.bus_off(0, 0);
    free.run(RECOVERY);
    CHECK(free.bus.state(0) == CanBus::State::ERROR_ACTIVE);
    Bench early(2);
    early.bus.bus_off(0, 0);
    early.run(RECOVERY - 1);
    CHECK(early.bus.state(0) == CanBus::State::BUS_OFF);

    // On a full bus there are 11 recessive bits behind each frame and nowhere else.
    Bench full(3);
    full.bus.queue(1, 0, frame_of(0x100));
    full.bus.bus_off(0, 0);
    uint64_t frames = 0;
    full.bus.run(CYCLES_PER_SECOND, [&](const CanBus::Delivery &delivery) {
        if (full.bus.state(0) == CanBus::State::BUS_OFF) frames++;
        full.bus.queue(1, delivery.at, frame_of(0x100));
    });
    CHECK(frames == 128);
}

TEST_CASE("a held bus-off lasts until the node is told to recover") {
    Bench bench(2);
    bench.bus.bus_off(0, 0, true);
    bench.run(10 * RECOVERY);
    CHECK(bench.bus.state(0) == CanBus::State::BUS_OFF);
    bench.bus.recover(0, 10 * RECOVERY);
    bench.run(12 * RECOVERY);
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_ACTIVE);
}

TEST_CASE("a node without acknowledgement tries for ever, error passive, never bus-off") {
    Bench bench(2);
    bench.bus.kill(1, 0);
    bench.bus.queue(0, 0, frame_of(0x100));
    CHECK(bench.bus.next() == NEVER);
    bench.run(CYCLES_PER_SECOND);
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_PASSIVE);
    CHECK(bench.bus.transmit_errors(0) == 128);
    CHECK(bench.bus.counts().frames == 0);
    // To the end of the acknowledge slot, flag and delimiter; intermission; from the 16th error on
    // it is error passive, and suspended for 8 bits more.
    Cycles attempt = length(frame_of(0x100)) + (-8 + 6 + 8) * BIT, begin = 0;
    uint64_t attempts = 0;
    for (; begin + attempt < CYCLES_PER_SECOND; attempts++)
        begin += attempt + GAP + (attempts + 1 >= 16 ? CAN_SUSPEND_BITS * BIT : 0);
    CHECK(bench.bus.counts().not_acknowledged == attempts);
    // A second node comes: the frame arrives, and one by one the errors go.
    bench.bus.recover(1, CYCLES_PER_SECOND);
    bench.run(2 * CYCLES_PER_SECOND);
    CHECK(bench.bus.counts().frames == 1);
    CHECK(bench.bus.transmit_errors(0) == 127);
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_ACTIVE);
}

TEST_CASE("a node that is error passive waits eight bits more before it sends again") {
    Bench bench(2, 0.3, 6);
    Cycles last = 0;
    uint64_t errors = 0;
    int active = 0, passive = 0;
    bool was_passive = false;
    for (Cycles at = 0; at < 20 * CYCLES_PER_SECOND; at += BIT) {
        while (bench.bus.queued(0) < 4 && bench.bus.queue(0, at, frame_of(0x100))) {
        }
        bench.bus.run(at + BIT, [&](const CanBus::Delivery &delivery) {
            // Two frames in a row, no error between them.
            if (bench.bus.counts().error_frames == errors && last != 0) {
                (was_passive ? passive : active)++;
                Cycles wait = was_passive ? GAP + CAN_SUSPEND_BITS * BIT : GAP;
                CHECK(delivery.begin == last + wait);
            }
            errors = bench.bus.counts().error_frames;
            last = delivery.at;
            was_passive = bench.bus.state(0) == CanBus::State::ERROR_PASSIVE;
        });
        if (bench.bus.state(0) == CanBus::State::BUS_OFF) last = 0;
    }
    CHECK(active > 100);
    CHECK(passive > 100);
}

TEST_CASE("receivers count errors by one and forget them frame by frame") {
    Bench bench(3, 1.0);
    bench.bus.queue(0, 0, frame_of(0x100));
    bench.bus.queue(0, 0, frame_of(0x100));
    // Four error frames, then a quiet wire is not to be had: look at the counters on the way.
    uint32_t seen = 0;
    for (Cycles at = 0; bench.bus.counts().error_frames < 4; at += BIT) {
        bench.run(at);
        seen = bench.bus.receive_errors(1);
    }
    CHECK(seen == 4);
    CHECK(bench.bus.transmit_errors(0) == 32);
    CHECK(bench.bus.receive_errors(0) == 0);

    Bench calm(3, 0.3, 11);
    uint32_t most = 0;
    for (int i = 0; i < 2000; i++) {
        Cycles at = static_cast<Cycles>(i) * 3000 * BIT;
        calm.bus.queue(i % 2, at, frame_of(0x100));
        calm.run(at + 3000 * BIT);
        most = std::max(most, calm.bus.receive_errors(2));
    }
    // 0.43 errors a frame add less than the frame takes away.
    CHECK(most > 0);
    CHECK(most < 40);
    CHECK(calm.bus.receive_errors(2) < 20);
}

TEST_CASE("a frame without an error takes one from a receiver's errors, and all above 119") {
    Bench bench(4, 0.75, 8);
    uint32_t before[4] = {};
    int from_passive = 0, ordinary = 0;
    std::mt19937 random(4);
    for (Cycles at = 0; at < 4 * CYCLES_PER_SECOND; at += BIT) {
        for (uint32_t node = 0; node < 3; node++)
            if (bench.bus.queued(node) == 0) bench.bus.queue(node, at, frame_of(0x100));
        for (uint32_t node = 0; node < 4; node++) {
            if (random() % 100'000 == 0) bench.bus.kill(node, at);
            if (bench.bus.state(node) == CanBus::State::DEAD && random() % 100 == 0)
                bench.bus.recover(node, at);
            before[node] = bench.bus.receive_errors(node);
        }
        bench.bus.run(at + BIT, [&](const CanBus::Delivery &delivery) {
            for (uint32_t node : *delivery.receivers) {
                uint32_t expected = before[node] - std::min(before[node], 1u);
                if (before[node] >= 128) expected = 119;
                CHECK(bench.bus.receive_errors(node) == expected);
                (before[node] >= 128 ? from_passive : ordinary)++;
            }
        });
        if (bench.bus.receive_errors(3) >= 128)
            CHECK(bench.bus.state(3) == CanBus::State::ERROR_PASSIVE);
    }
    CHECK(from_passive > 10);
    CHECK(ordinary > 1000);
}

TEST_CASE(
    "a node that dies takes its frames with it and disturbs others for no longer than an error") {
    Bench bench(4);
    for (int i = 0; i < 5; i++) bench.bus.queue(0, 0, frame_of(0x100));
    bench.bus.queue(1, 0, frame_of(0x200));
    bench.run(50 * BIT);
    bench.bus.kill(0, 50 * BIT);
    bench.run(CYCLES_PER_SECOND);
    CHECK(bench.bus.state(0) == CanBus::State::DEAD);
    CHECK(bench.bus.counts().lost_dead == 5);
    REQUIRE(bench.log.size() == 1);
    CHECK(bench.log[0].sender == 1);
    CHECK(bench.log[0].begin == (50 + 6 + 20 + 3) * BIT);
    CHECK(bench.log[0].receivers == std::vector<uint32_t>{2, 3});
    CHECK_FALSE(bench.bus.queue(0, CYCLES_PER_SECOND, frame_of(0x100)));
    bench.bus.recover(0, CYCLES_PER_SECOND);
    CHECK(bench.bus.queue(0, CYCLES_PER_SECOND, frame_of(0x100)));
    bench.run(2 * CYCLES_PER_SECOND);
    CHECK(bench.log.back().sender == 0);
}

TEST_CASE("a node that comes up in the middle of a frame does not receive it") {
    Bench bench(3);
    bench.bus.kill(2, 0);
    bench.bus.queue(0, 0, frame_of(0x100));
    bench.bus.queue(0, 0, frame_of(0x101));
    bench.run(20 * BIT);
    bench.bus.recover(2, 20 * BIT);
    bench.run(CYCLES_PER_SECOND);
    REQUIRE(bench.log.size() == 2);
    CHECK(bench.log[0].receivers == std::vector<uint32_t>{1});
    CHECK(bench.log[1].receivers == std::vector<uint32_t>{1, 2});
}

TEST_CASE("if the only listener dies within a frame, the frame is not acknowledged") {
    Bench bench(2);
    bench.bus.queue(0, 0, frame_of(0x100));
    bench.run(50 * BIT);
    bench.bus.kill(1, 50 * BIT);
    bench.run(300 * BIT);
    CHECK(bench.log.empty());
    CHECK(bench.bus.counts().not_acknowledged >= 1);
    CHECK(bench.bus.queued(0) == 1);
}

TEST_CASE("a frame that was acknowledged arrives, whoever dies at its end") {
    Bench bench(2);
    bench.bus.queue(0, 0, frame_of(0x100));
    Cycles end = length(frame_of(0x100));
    bench.run(end - 5 * BIT);
    bench.bus.kill(1, end - 5 * BIT);
    bench.run(end + 1);
    REQUIRE(bench.log.size() == 1);
    CHECK(bench.log[0].receivers.empty());
}

TEST_CASE("a newcomer misses the frame on the wire although all are there again") {
    CanBus bus({}, Chance(1), 0);
    bus.attach({"sender", {{0x001, 0x7FF}}, 4});
    bus.attach({"listener", {{0x100, 0x7FF}}, 4});
    bus.attach({"newcomer", {{0x100, 0x7FF}}, 4});
    std::vector<std::vector<uint32_t>> receivers;
    auto note = [&](const CanBus::Delivery &d) { receivers.push_back(*d.receivers); };
    bus.kill(2, 0);
    bus.queue(0, 0, frame_of(0x100));
    bus.queue(0, 0, frame_of(0x100));
    bus.run(20 * BIT, note);
    bus.recover(2, 20 * BIT);
    bus.run(CYCLES_PER_SECOND, note);
    CHECK(receivers == std::vector<std::vector<uint32_t>>{{1}, {1, 2}});
}

TEST_CASE("a held bus-off ends with a power cycle") {
    Bench bench(2);
    bench.bus.bus_off(0, 0, true);
    bench.bus.kill(0, 0);
    bench.bus.recover(0, 0);
    CHECK(bench.bus.state(0) == CanBus::State::ERROR_ACTIVE);
    // Nothing is left of it that could bring the node back a second time.
    bench.bus.recover(0, 0);
    bench.run(2 * RECOVERY);
    bench.bus.kill(1, 2 * RECOVERY);
    bench.bus.queue(0, 2 * RECOVERY, frame_of(0x100));
    CHECK(bench.bus.next() == NEVER);
    bench.run(3 * RECOVERY);
    CHECK(bench.log.empty());
}

TEST_CASE("errors at random, deaths and returns lose nothing that is not counted") {
    Bench bench(10, 0.15, 5);
    std::mt19937 random(9);
    uint64_t wanted = 0;
    Cycles at = 0;
    for (int i = 0; i < 20'000; i++) {
        at += random() % (300 * BIT);
        bench.run(at);
        uint32_t node = random() % 10;
        wanted++;
        bench.bus.queue(node, at, frame_of(static_cast<uint16_t>(random() % 0x800)));
        if (i % 97 == 0) bench.bus.kill(node, at);
        if (i % 89 == 0) bench.bus.bus_off(random() % 10, at, i % 2 == 0);
        if (i % 13 == 0) bench.bus.recover(random() % 10, at);
    }
    for (uint32_t node = 0; node < 10; node++) bench.bus.recover(node, at);
    bench.run(at + 100 * CYCLES_PER_SECOND);
    uint64_t waiting = 0;
    for (uint32_t node = 0; node < 10; node++) waiting += bench.bus.queued(node);
    CHECK(waiting == 0);
    CHECK(bench.bus.counts().frames == bench.log.size());
    CHECK(bench.log.size() + lost(bench.bus) == wanted);
    CHECK(bench.log.size() > wanted / 2);
    for (size_t i = 1; i < bench.log.size(); i++)
        REQUIRE(bench.log[i].begin >= bench.log[i - 1].at + GAP);
}

}  // namespace test_can_bus
