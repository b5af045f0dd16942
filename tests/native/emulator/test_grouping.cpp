// Grouping: which contacts are in closed form, and which bodies need a solver.
#include <doctest/doctest.h>

#include "physics/contact/grouping.h"
#include "support.h"

using namespace kilotwin;
using namespace kilotwin::testing;

namespace test_grouping {

namespace {

using Kind = ContactBody::Kind;

constexpr double RADIUS = 0.085, DIAMETER = 0.17;

/// A body that would go `free` if nothing touched it.
ContactBody body(double x, double y, const Eigen::Vector2d &free) {
    ContactBody body{{{x, y}, 0}, {free, 0}};
    body.kind = Kind::NONE;
    return body;
}

/// Pairs of all bodies within 1 m, as if each were within reach.
std::vector<ContactPair> all_pairs(const std::vector<ContactBody> &bodies) {
    std::vector<ContactPair> pairs;
    for (uint32_t i = 0; i < bodies.size(); i++)
        for (uint32_t k = i + 1; k < bodies.size(); k++) {
            const double apart = (bodies[k].pose.position - bodies[i].pose.position).norm();
            if (apart < 1) pairs.push_back({i, k, apart});
        }
    return pairs;
}

struct Case {
    Arena arena = square_hall(4);
    Team alone;
    Grouping grouping{arena, RADIUS, alone};
    Crowd crowd;
    std::vector<ContactBody> &bodies = crowd.bodies;

    explicit Case(std::vector<ContactBody> of) : crowd{std::move(of), {}, {}} {
        crowd.shares = {{0, static_cast<uint32_t>(bodies.size()), all_pairs(bodies)}};
        grouping.find_groups(crowd);
        grouping.choose(crowd, 0);
    }
    bool find_missed() { return grouping.find_missed(crowd, 0); }
};

const Eigen::Vector2d RIGHT(0.003, 0), LEFT(-0.003, 0), STILL(0, 0);

}  // namespace

TEST_CASE("two that press and one that only passes by are a pair and a robot alone") {
    Case c({body(0, 0, RIGHT), body(DIAMETER, 0, STILL), body(2 * DIAMETER + 0.004, 0, RIGHT)});
    CHECK(c.bodies[0].kind == Kind::ROBOT);
    CHECK(c.bodies[1].kind == Kind::ROBOT);
    CHECK(c.bodies[0].other == 1);
    CHECK(c.bodies[1].other == 0);
    CHECK(c.bodies[1].normal == -c.bodies[0].normal);
    CHECK(c.bodies[2].kind == Kind::NONE);
    for (const auto &one : c.bodies) CHECK(one.uncertain);
}

TEST_CASE("a robot that touches two, one of them only at the end of the step, is in an island") {
    Case c({body(0, 0, RIGHT), body(DIAMETER, 0, STILL), body(2 * DIAMETER + 0.0028, 0, LEFT)});
    for (const auto &one : c.bodies) CHECK(one.kind == Kind::ISLAND);
    for (const auto &one : c.bodies) CHECK_FALSE(one.uncertain);
}

TEST_CASE("robots that nearly touch count as touching") {
    const double nearly = ContactBody::NEARLY * RADIUS;
    for (double gap : {0.9 * nearly, 1.1 * nearly}) {
        Case c({body(0, 0, RIGHT), body(DIAMETER, 0, STILL), body(2 * DIAMETER + gap, 0, STILL)});
        CHECK((c.bodies[1].kind == Kind::ISLAND) == (gap < nearly));
    }
}

TEST_CASE("a contact missed makes an island of its group, and of no other") {
    Case c({body(0, 0, RIGHT), body(DIAMETER, 0, STILL), body(2 * DIAMETER + 0.004, 0, STILL),
            body(0, 1.5, RIGHT), body(DIAMETER, 1.5, STILL)});
    REQUIRE(c.bodies[1].kind == Kind::ROBOT);
    CHECK_FALSE(c.bodies[3].uncertain);

    SUBCASE("where nothing came nearer, there is none") {
        CHECK_FALSE(c.find_missed());
        CHECK(c.bodies[1].kind == Kind::ROBOT);
    }
    SUBCASE("where the second was pushed into the third") {
        c.bodies[1].moved.by = {0.0041, 0};
        CHECK(c.find_missed());
        for (int i = 0; i < 3; i++) CHECK(c.bodies[i].kind == Kind::ISLAND);
        CHECK(c.bodies[3].kind == Kind::ROBOT);
        CHECK(c.bodies[4].kind == Kind::ROBOT);
    }
}

TEST_CASE("a robot near a wall and pushed by another is looked at once more") {
    auto near_wall = [](double gap) {
        ContactBody one = body(2 - RADIUS - gap, 0, STILL);
        one.kind = Kind::WALL;
        one.at_wall = true;
        one.normal = {1, 0};
        one.gap_m = gap;
        one.touches = ContactBody::meets(gap, one.normal, one.free.by, RADIUS);
        return one;
    };
    const double x = 2 - RADIUS - 0.003;
    Case c({near_wall(0.003), body(x - DIAMETER, 0, RIGHT)});
    REQUIRE(c.bodies[0].kind == Kind::ROBOT);
    CHECK(c.bodies[0].uncertain);
    c.bodies[0].moved.by = {0.002, 0};
    CHECK_FALSE(c.find_missed());
    c.bodies[0].moved.by = {0.0031, 0};
    CHECK(c.find_missed());
    CHECK(c.bodies[1].kind == Kind::ISLAND);

    Case at_wall({near_wall(0), body(2 - RADIUS - DIAMETER, 0, RIGHT)});
    CHECK(at_wall.bodies[0].kind == Kind::ISLAND);
    Case alone({near_wall(0.003)});
    CHECK(alone.bodies[0].kind == Kind::WALL);
    CHECK_FALSE(alone.bodies[0].uncertain);
}

TEST_CASE("all that may touch a body at an object are in its island") {
    ContactBody at_object = body(0, 0, STILL);
    at_object.kind = Kind::ISLAND;
    Case c({at_object, body(DIAMETER + 0.004, 0, STILL)});
    CHECK(c.bodies[0].kind == Kind::ISLAND);
    CHECK(c.bodies[1].kind == Kind::ISLAND);
}

TEST_CASE("bodies are grouped the same however they are cut into shares") {
    Dice dice(5);
    constexpr uint32_t COUNT = 300;
    std::vector<ContactBody> bodies;
    for (uint32_t i = 0; i < COUNT; i++) {  // neighbours are mostly of different shares
        bodies.push_back(body(dice.between(-2, 2), dice.between(-2, 2),
                              {dice.between(-0.02, 0.02), dice.between(-0.02, 0.02)}));
        bodies.back().at_wall = dice.below(10) == 0;
        if (dice.below(50) == 0) bodies.back().kind = Kind::ISLAND;
    }
    std::vector<ContactPair> pairs = all_pairs(bodies);
    std::erase_if(pairs, [](const ContactPair &pair) { return pair.distance_m > 1.3 * DIAMETER; });

    std::vector<ContactBody> alone;
    for (const uint32_t members : {1u, 2u, 3u, 8u}) {
        CAPTURE(members);
        Team team(members, nullptr);
        Crowd crowd{bodies, {}, {}};
        for (uint32_t share = 0; share < members; share++) {
            crowd.shares.push_back({static_cast<uint32_t>(team.begin_of(share, COUNT)),
                                    static_cast<uint32_t>(team.begin_of(share + 1, COUNT)),
                                    {}});
            for (const ContactPair &pair : pairs)
                if (team.share_of(pair.one, COUNT) == share)
                    crowd.shares[share].pairs.push_back(pair);
        }
        const Arena arena = square_hall(4);
        Grouping grouping(arena, RADIUS, team);
        grouping.find_groups(crowd);
        team.share([&](uint32_t share) {
            grouping.choose(crowd, share);
            grouping.for_each_body(crowd, share, [&](uint32_t i) {
                if (crowd.bodies[i].kind != Kind::ISLAND) crowd.bodies[i].moved = bodies[i].free;
            });
            grouping.find_missed(crowd, share);
        });
        if (members == 1) alone = crowd.bodies;
        size_t islands = 0, singles = 0;
        for (uint32_t i = 0; i < COUNT; i++) {
            const ContactBody &one = alone[i], &several = crowd.bodies[i];
            CHECK(several.kind == one.kind);
            CHECK(several.uncertain == one.uncertain);
            CHECK(several.touches == one.touches);
            CHECK(several.other == one.other);
            CHECK(several.normal == one.normal);
            islands += one.kind == Kind::ISLAND;
            singles += one.kind == Kind::ROBOT || one.kind == Kind::NONE;
        }
        CHECK(islands > 20);
        CHECK(singles > 20);
    }
}

}  // namespace test_grouping
