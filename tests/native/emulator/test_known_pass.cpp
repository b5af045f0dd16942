#include "robots/translated/passes/known_pass.h"

#include <doctest/doctest.h>

#include "support.h"

using namespace kilotwin;
using kilotwin::testing::Dice;

namespace test_known_pass {

namespace {

using Kind = BranchCondition::Kind;

constexpr unsigned BYTE_BITS = 8;
constexpr uint32_t WATCHED_TICKS = 700;

/// The chip's flags after a comparison of the two numbers.
bool outcome_of(const BranchCondition &condition, const uint8_t *data, uint32_t ticks) {
    const uint64_t mask = (uint64_t{1} << condition.bits) - 1;
    const uint64_t a = condition.a.value(data, ticks) & mask;
    const uint64_t b = condition.b.value(data, ticks) & mask;
    const unsigned unused = 64 - condition.bits;
    switch (condition.kind) {
    case Kind::ZERO: return a == 0;
    case Kind::BIT: return (a >> condition.bit & 1) != 0;
    case Kind::LESS: return a < b;
    default: return static_cast<int64_t>(a << unused) < static_cast<int64_t>(b << unused);
    }
}

/// A sum of the ticks, near a turn of theirs, and of two bytes.
LinearForm number_of(Dice &dice, int slope) {
    LinearForm number;
    number.slope = slope;
    number.constant = dice.below(300) - uint64_t{dice.below(300)};
    number.terms = {{0, 0, 1}, {1, static_cast<uint8_t>(BYTE_BITS * dice.below(2)), -1}};
    return number;
}

BranchCondition condition_of(Dice &dice) {
    BranchCondition condition = {};
    condition.kind = static_cast<Kind>(dice.below(4));
    condition.bits = static_cast<uint8_t>(BYTE_BITS * (1 + dice.below(4)));
    condition.bit = static_cast<uint8_t>(dice.below(condition.bits));
    const int slope = static_cast<int>(dice.below(3)) - 1;
    condition.a = number_of(dice, slope);
    condition.b = number_of(dice, dice.below(2) != 0 ? slope : 0);
    return condition;
}

}  // namespace

TEST_CASE("a condition comes out as it did for as many ticks as it says") {
    uint32_t ended = 0;
    for (uint64_t seed = 1; seed <= 3000; seed++) {
        Dice dice(seed);
        const uint8_t data[] = {static_cast<uint8_t>(dice.below(256)),
                                static_cast<uint8_t>(dice.below(256))};
        const uint32_t now = dice.below(2) != 0 ? dice.below(1000) : UINT32_MAX - dice.below(300);
        BranchCondition condition = condition_of(dice);
        condition.outcome = outcome_of(condition, data, now);
        const uint64_t lasts = condition.lasts(data, now);
        REQUIRE(lasts > 0);
        for (uint32_t tick = 0; tick < WATCHED_TICKS && tick < lasts; tick++)
            REQUIRE(outcome_of(condition, data, now + tick) == condition.outcome);
        ended += lasts < WATCHED_TICKS;
        condition.outcome = !condition.outcome;
        REQUIRE(condition.lasts(data, now) == 0);
    }
    CHECK(ended > 300);
}

TEST_CASE("a wait for a tick ends at that tick") {
    const uint8_t last[] = {200, 1, 0, 0};
    LinearForm ticks, since, limit;
    ticks.slope = 1;
    since = ticks;
    LinearForm from;
    for (uint8_t i = 0; i < 4; i++) from.terms.push_back({i, static_cast<uint8_t>(8 * i), 1});
    since.add(from, -1);
    limit.constant = 32;
    const BranchCondition early = {Kind::LESS, 32, 0, true, since, limit};
    CHECK(early.lasts(last, 456) == 32);
    CHECK(early.lasts(last, 487) == 1);
    CHECK(early.lasts(last, 488) == 0);
}

TEST_CASE("a pass is another one where a byte that it depends on differs") {
    KnownPass pass = {};
    pass.rest.equal = {{0, 5}, {2, 7}};
    const uint8_t same[] = {5, 1, 7}, other[] = {5, 1, 8};
    CHECK(pass.lasts(same, 3) == PathCondition::MOST_TICKS);
    CHECK(pass.lasts(other, 3) == 0);
}

TEST_CASE("a pass that notes its tick is known only while the note is of this tick") {
    KnownPass pass = {};
    pass.copies = {{1, 2, 5}};
    LinearForm ticks, end;
    ticks.slope = 1;
    end.constant = 300;
    pass.first.conditions = {{Kind::LESS, 16, 0, true, ticks, end}};
    const uint8_t noted[] = {0, 0x05, 0x01}, late[] = {0, 0x04, 0x01}, wide[] = {0, 0x05, 0x02};
    CHECK(pass.lasts(noted, 256) == 44);  // the tick 300 is the first that differs
    CHECK(pass.lasts(late, 256) == 0);
    CHECK(pass.lasts(wide, 256) == 0);
}

TEST_CASE("what a tick asks beyond the rest is added once, and not what the rest says of it") {
    LinearForm ticks, before, variable;
    ticks.slope = before.slope = 1;
    before.constant = UINT64_MAX;
    variable.terms = {{2, 0, 1}};
    KnownPass pass = {};
    pass.rest.equal = {{0, 5}};
    pass.rest.conditions = {{Kind::LESS, 8, 0, true, ticks, variable}};
    PathCondition more;
    more.equal = {{0, 5}, {1, 6}};
    more.conditions = {{Kind::LESS, 8, 0, true, ticks, variable},
                       {Kind::LESS, 8, 0, true, before, variable},
                       {Kind::ZERO, 8, 0, false, before, {}}};
    pass.add_to_first(more);
    pass.add_to_first(more);
    CHECK(pass.first.equal == std::vector<PathCondition::Equal>{{1, 6}});
    CHECK(pass.first.conditions == std::vector<BranchCondition>{more.conditions[2]});
    CHECK(pass.rest.has(1, 2));
    CHECK_FALSE(pass.rest.has(3, 4));
    CHECK_FALSE(pass.rest.has(1, 1));
}

TEST_CASE("of more passes than there is room for the oldest are forgotten") {
    using Passes = KnownOnes<KnownPass>;
    Passes known;
    for (uint32_t i = 0; i < Passes::MOST + 3; i++) {
        KnownPass pass = {};
        pass.cycles = i;
        CHECK(known.keep(pass).cycles == i);
    }
    CHECK(known.all.size() == Passes::MOST);
    CHECK(known.all[2].cycles == Passes::MOST + 2);
    CHECK(known.all[3].cycles == 3);
}

}  // namespace test_known_pass
