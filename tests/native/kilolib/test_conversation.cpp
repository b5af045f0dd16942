/// Two robots that see each other's light, pulse by pulse.
#include "bench.h"

using namespace kilotwin;

namespace test_conversation {

namespace {

/// Pulses that one sends, the other sees a moment later.
void pass_light(Bench &from, Bench &to, distance_measurement_t strength, Cycles lag) {
    for (const auto &light : from.board.outputs.light)
        if (light.on)
            to.board.shine({light.at + lag, light.at + lag + RobotBoard::SEEN_PULSE, strength});
    from.board.outputs.light.clear();
}

void live_together(Bench &a, Bench &b, double ms) {
    constexpr Cycles QUANTUM = 400;
    const Cycles end = a.board.now() + static_cast<Cycles>(ms * double(MS));
    for (Cycles now = a.board.now(); now < end; now += QUANTUM) {
        a.board.run(now + QUANTUM);
        b.board.run(now + QUANTUM);
        pass_light(a, b, {200, 640}, 2 * QUANTUM);
        pass_light(b, a, {250, 800}, 2 * QUANTUM);
    }
}

void say(Bench &bench, const message_t &message) {
    const auto *bytes = reinterpret_cast<const uint8_t *>(&message);
    for (uint16_t i = 0; i < sizeof message; i++)
        bench.board.write(static_cast<uint16_t>(bench.address("outgoing") + i), bytes[i]);
    bench.set("talks", 255, 1);
}

}  // namespace

TEST_CASE("two robots hear each other") {
    Bench a("probe", 1), b("probe", 2, 7 * MS);
    a.start();
    b.board.run(a.board.now());
    b.start();
    a.board.run(b.board.now());
    say(a, make_message(2, {1, 0x55}));
    say(b, make_message(3, {2, 0xAA}));
    live_together(a, b, 5000);
    CHECK(a.byte("sent") >= 9);
    CHECK(b.byte("sent") >= 9);
    CHECK(a.word("received_count", 2) == b.byte("sent"));
    CHECK(b.word("received_count", 2) == a.byte("sent"));
    CHECK(a.word("last_message", 2) == 0xAA02);
    CHECK(b.word("last_message", 2) == 0x5501);
    CHECK(a.low_gain() == 250);
    CHECK(b.high_gain() == 640);
}

TEST_CASE("two robots that always want to send share the channel") {
    Bench a("probe", 1), b("probe", 2, 7 * MS);
    a.start();
    b.board.run(a.board.now());
    b.start();
    a.board.run(b.board.now());
    for (Bench *bench : {&a, &b}) {
        say(*bench, make_message(2, {1}));
        bench->set("kilo_tx_period", 1, 2);
    }
    live_together(a, b, 3000);
    CHECK(a.byte("sent") >= 60);
    CHECK(b.byte("sent") >= 60);
    CHECK(a.word("received_count", 2) + 5 >= b.byte("sent"));
    CHECK(b.word("received_count", 2) + 5 >= a.byte("sent"));
}

}  // namespace test_conversation
