"""Which robots are informed, and for which site."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.experiment.spec.informed import informed_for, informed_ranges
from kilotwin.experiment.spec.informed_counts import informed_count, split

from ..conftest import INFORMED, SMALL, Load


@pytest.mark.parametrize(
    ("size", "share", "expected"),
    [(100, 0.3, 30), (50, 0.1, 5), (50, 0.29, 15), (50, 0.07, 4), (10, 0.0, 0), (3, 1.0, 3)],
)
def test_the_informed_are_rounded_half_up(size: int, share: float, expected: int) -> None:
    assert informed_count(size, share) == expected


@pytest.mark.parametrize("informed", [5, 10, 15, 20, 25, 30, 40, 50])
@pytest.mark.parametrize("tenths", [5, 6, 7, 8, 9, 10])
def test_two_sites_are_shared_as_in_the_paper(informed: int, tenths: int) -> None:
    black = (2 * informed * tenths + 10) // 20  # half up, in whole numbers
    shares = {"black": tenths / 10, "white": (10 - tenths) / 10}
    assert split(informed, shares) == {"black": black, "white": informed - black}


@given(
    st.integers(0, 1000),
    st.lists(st.integers(0, 20), min_size=1, max_size=6).filter(lambda parts: sum(parts) > 0),
)
def test_everybody_informed_is_informed_for_one_site(count: int, parts: list[int]) -> None:
    shares = {str(site): part / sum(parts) for site, part in enumerate(parts)}
    got = split(count, shares)
    assert sum(got.values()) == count
    assert all(abs(got[site] - count * share) < 1 for site, share in shares.items())


def test_informed_robots_come_first_site_after_site(load: Load) -> None:
    keys = load(SMALL + INFORMED, "swarm.informed=0.5").keys
    assert informed_for(keys) == {"black": 4, "white": 1}
    assert informed_ranges(keys) == [(1, 0, 4), (2, 4, 1)]


def test_the_order_is_that_of_the_sites(load: Load) -> None:
    shares = "{ white = 0.7, black = 0.3 }"
    keys = load(SMALL + "[controller]\n", f"swarm.informed_for={shares}", "swarm.informed=1").keys
    assert informed_ranges(keys) == [(1, 0, 3), (2, 3, 7)]


def test_a_site_nobody_is_informed_for_is_left_out(load: Load) -> None:
    keys = load(SMALL + "[controller]\n", "swarm.informed_for.white=1", "swarm.informed=0.2").keys
    assert informed_for(keys) == {"black": 0, "white": 2}
    assert informed_ranges(keys) == [(2, 0, 2)]
