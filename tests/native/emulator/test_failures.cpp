// A robot whose program fails is parked and reported; all others go on. `crashes` fails in a way of
// its own for each uid.
#include <doctest/doctest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>

#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_failures {

namespace {

struct Failure {
    uint32_t uid;
    EventKind kind;
    std::string text;  ///< how the report begins
};

const Failure FAILURES[] = {
    {1, EventKind::CRASH, "Segmentation fault at address"},
    {2, EventKind::CRASH, "it wrote or read beyond its own variables"},
    {3, EventKind::CRASH, "it wrote or read beyond its own variables"},
    {4, EventKind::STACK_OVERFLOW, "its stack grew over 65536 bytes"},
    {5, EventKind::CRASH, "called exit()"},
    {6, EventKind::CRASH, "called abort()"},
    {7, EventKind::CRASH, "Segmentation fault at address"},
    {8, EventKind::CRASH, "Illegal instruction at address"},
    {9, EventKind::CRASH, "Segmentation fault at address 0x7000"},
};

bool is_note(const Event &event) { return event.kind == EventKind::NOTE; }

Bench crashed() { return Bench(std::vector<std::string>(10, "crashes")); }

}  // namespace

TEST_CASE("each kind of failure is reported once, with program, robot and tick, and the others go "
          "on unharmed") {
    for (Cycles slice : {ticks(1), ticks(500)}) {
        auto bench = crashed();
        for (uint32_t robot = 0; robot < 10; robot++) bench.tell(10, robot, run_message());
        bench.run(ticks(400), slice);
        for (const auto &failure : FAILURES) {
            CAPTURE(failure.uid);
            auto others = bench.others(failure.uid - 1);
            std::erase_if(others, is_note);
            REQUIRE(others.size() == 1);
            CHECK(others[0].kind == failure.kind);
            CHECK(others[0].text.starts_with(failure.text));
            CHECK(others[0].program == "crashes");
            CHECK(others[0].robot == failure.uid - 1);
            CHECK(others[0].tick == 100);
            CHECK(others[0].at == ticks(100));
            CHECK(bench.robot(failure.uid - 1).stopped());
            CHECK(bench.said(failure.uid - 1).empty());
        }
        CHECK(bench.others(9).empty());
        CHECK_FALSE(bench.robot(9).stopped());
        CHECK(bench.said(9) == std::vector<std::string>{"lives on, 0 0"});
    }
}

TEST_CASE("a division by zero, a NULL pointer and an index that is a little off do not stop a "
          "robot, and are noted once") {
    for (Cycles slice : {ticks(1), ticks(500)}) {
        Bench bench(std::vector<std::string>(2, "mistakes"));
        for (uint32_t robot = 0; robot < 2; robot++) bench.tell(10, robot, run_message());
        bench.run(ticks(400), slice);
        const std::vector<std::string> quotients = {"65535 1000", "1 -7", "-1 5", "-1 70000"};
        auto expected = quotients;
        expected.insert(expected.end(), {"0 0 1 1", "0", "1", "0 0", "0 0 1"});
        expected.insert(expected.end(), quotients.begin(), quotients.end());
        expected.push_back("lives on");
        CHECK(bench.said(0) == expected);
        auto others = bench.others(0);
        const char *const texts[] = {"it divides by zero",
                                     "it uses a pointer that is NULL or wild, at address 0x00",
                                     "it goes beyond its own variables"};
        REQUIRE(others.size() == std::size(texts));
        for (size_t i = 0; i < std::size(texts); i++) {
            CHECK(others[i].kind == EventKind::NOTE);
            CHECK(others[i].tick == 100);
            CHECK(others[i].text.starts_with(texts[i]));
        }
        CHECK(bench.others(1).empty());
        CHECK_FALSE(bench.robot(0).stopped());
    }
}

TEST_CASE("what one robot's floats have noted is told to no other") {
    Bench bench({"exact", "exact"});
    for (uint32_t robot = 0; robot < 2; robot++) bench.tell(10, robot, run_message());
    bench.run(ticks(30), ticks(1));
    CHECK(bench.others(1).empty());
    CHECK_FALSE(bench.said(1).empty());
}

TEST_CASE("a call through NULL starts the program again, as on the robot, and is noted once") {
    for (Cycles slice : {ticks(1), ticks(500)}) {
        // By uid: from loop(), the callback that sends, the one that receives; main() itself,
        // always.
        Bench bench(std::vector<std::string>(4, "restarts"));
        for (uint64_t run : {10u, 200u})
            for (uint32_t robot = 0; robot < 4; robot++)
                bench.tell(ticks(run), robot, run_message());
        for (uint64_t at : {60u, 260u}) bench.tell(ticks(at), 2, message(5));
        bench.run(ticks(400), slice);
        const std::vector<std::string> twice = {"begins, 0", "begins, 0"};
        for (uint32_t robot = 0; robot < 4; robot++) {
            CAPTURE(robot);
            CHECK(bench.said(robot) == (robot < 3 ? twice : std::vector<std::string>{}));
            CHECK_FALSE(bench.robot(robot).stopped());
            auto others = bench.others(robot);
            REQUIRE(others.size() == 1);
            CHECK(others[0].kind == EventKind::NOTE);
            CHECK(others[0].text.starts_with("it jumped to address 0"));
        }
    }
}

TEST_CASE("a robot whose main() comes back is reported") {
    Bench bench({"no_start", "roll_call"});
    bench.tell(ticks(5), 1, run_message());
    bench.run(ticks(20));
    auto others = bench.others(0);
    REQUIRE(others.size() == 1);
    CHECK(others[0].kind == EventKind::CRASH);
    CHECK(others[0].text == "main() came back: it never called kilo_start()");
    CHECK(others[0].program == "no_start");
    CHECK(others[0].tick == 3);
    CHECK(bench.said(1).size() == 1);
}

TEST_CASE("a parked robot stands still and hears nothing") {
    Scene scene(square_hall(4));
    scene.add("crashes", {{{0, 0}, 0}});
    scene.tell(200, 0, run_message());
    Simulation simulation(scene.def);
    simulation.advance(110);
    Pose when = pose_of(simulation.snapshot(), 0);
    CHECK(when.position.x() > 0.1);
    simulation.advance(300);
    Pose later = pose_of(simulation.snapshot(), 0);
    CHECK((later.position - when.position).norm() < 0.01);
    CHECK(simulation.take_events().size() == 1);
}

TEST_CASE("robots fail in a world as on the bench, and the world goes on") {
    Scene scene(square_hall(12));
    std::vector<Pose> poses;
    for (int i = 0; i < 10; i++) poses.push_back({{0, i - 4.5}, 0});
    scene.add("crashes", poses);
    Simulation simulation(scene.def);
    simulation.advance(400);
    auto events = simulation.take_events();
    std::erase_if(events, is_note);
    for (uint32_t robot = 0; robot < 9; robot++) {
        CAPTURE(robot);
        CHECK(texts(events, robot).empty());
    }
    CHECK(events.size() == 10);
    CHECK(texts(events, 9) == std::vector<std::string>{"lives on, 0 0"});
    CHECK(simulation.tick() == 400);
}

TEST_CASE("after a guest's fault the process still dies of its own") {
    // The engine's handler must only take what happens on the guests' stack.
    auto bench = crashed();
    bench.tell(10, 0, run_message());
    bench.run(ticks(110));
    REQUIRE(bench.robot(0).stopped());
    pid_t child = fork();
    if (child == 0) {
        raise(SIGSEGV);
        _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFSIGNALED(status));
    CHECK(WTERMSIG(status) == SIGSEGV);
}

}  // namespace test_failures
