#include "physics/overlaps.h"

#include <doctest/doctest.h>

using namespace kilotwin;

namespace test_overlaps {

TEST_CASE("overlaps count contacts, keep the worst, and give the median to 0.0001") {
    Overlaps overlaps;
    CHECK(overlaps.median() == 0);
    CHECK(overlaps.worst() == 0);
    CHECK(overlaps.contacts() == 0);
    for (int i = 1; i <= 99; i++) overlaps.add(i * 0.0005 + 0.00003);
    CHECK(overlaps.contacts() == 99);
    CHECK(overlaps.worst() == doctest::Approx(0.04953));
    CHECK(overlaps.median() >= 0.02503);
    CHECK(overlaps.median() <= 0.02503 + 0.0001);
}

TEST_CASE("one contact is its own median, and a whole robot in another is not beyond the scale") {
    Overlaps one, huge;
    one.add(0.00314);
    CHECK(one.median() == doctest::Approx(0.0032));
    huge.add(0.9);
    CHECK(huge.worst() == 0.9);
    CHECK(huge.median() > 0.2);
}

TEST_CASE("overlaps that were counted apart are as if counted together") {
    Overlaps together, all;
    for (int part = 0; part < 3; part++) {
        Overlaps apart;
        for (int i = 1; i <= 20; i++) {
            apart.add(0.001 * i * (part + 1));
            together.add(0.001 * i * (part + 1));
        }
        all.add(apart);
    }
    CHECK(all.contacts() == together.contacts());
    CHECK(all.worst() == together.worst());
    CHECK(all.median() == together.median());
}

}  // namespace test_overlaps
