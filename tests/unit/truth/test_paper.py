"""The verdicts on the paper's claims, on endings made up so that each must hold or miss."""

from collections.abc import Iterator

import pytest
from tests.truth.findings import (
    HOLDS,
    MISSED,
    OPEN,
    Finding,
    as_dict,
    report_text,
    verdicts,
)
from tests.truth.paper import _a, _b, _c, _d, _e

from kilotwin.studies.sweep.conditions import Condition, Conditions, Ending

SHARES = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
INFORMED = (0.1, 0.2, 0.3, 0.4, 0.5)


def trials(endings: dict[Condition, list[Ending]]) -> Conditions:
    return Conditions("made up", ("black", "white"), endings)


def alone(rule: str, *runs: tuple[int, int, int]) -> Conditions:
    condition = Condition(rule, 100, 0.0, (0.0, 0.0))
    return trials({condition: [Ending((black, white), rest) for black, white, rest in runs]})


def cells() -> Iterator[Condition]:
    for robots in (50, 100):
        for informed in INFORMED:
            for share in SHARES:
                yield Condition("simplified", robots, informed, (share, round(1 - share, 1)))


def grid(simplified: tuple[int, int], firat: tuple[int, int]) -> Conditions:
    """Robots short of the target on black, and how far two trials are apart, by controller."""
    endings = {}
    for cell in cells():
        for rule, (short, apart) in (("simplified", simplified), ("firat", firat)):
            condition = Condition(rule, cell.robots, cell.informed, cell.shares)
            black, white = map(round, condition.wanted)
            runs = [-apart, 0, 0, apart] * 3
            endings[condition] = [
                Ending((max(black - short + shift, 0), max(white - shift, 0)), short)
                for shift in runs
            ]
    return trials(endings)


def found(findings: list[Finding]) -> list[str]:
    return [finding.verdict for finding in findings]


def test_claim_a_holds_where_the_swarm_gathers_again_and_again() -> None:
    runs = [(95, 1, 4)] * 28 + [(1, 94, 5)] * 20 + [(50, 48, 2)] * 2
    assert found(_a(alone("simplified", *runs))) == [HOLDS, HOLDS]


def test_claim_a_is_missed_by_half_of_the_runs() -> None:
    assert found(_a(alone("simplified", *[(96, 0, 4), (50, 46, 4)] * 25))) == [MISSED, HOLDS]


@pytest.mark.parametrize(("nowhere", "verdict"), [(1, MISSED), (2, HOLDS), (6, HOLDS), (7, MISSED)])
def test_claim_a_wants_two_to_six_robots_nowhere(nowhere: int, verdict: str) -> None:
    runs = [(100 - nowhere, 0, nowhere)] * 20
    assert found(_a(alone("simplified", *runs))) == [HOLDS, verdict]


def test_claim_b_holds_where_medians_follow_the_target() -> None:
    assert set(found(_b(grid((1, 1), (1, 1))))) == {HOLDS}


def test_claim_b_is_missed_by_robots_that_stay_away() -> None:
    far = _b(grid((1, 1), (30, 1)))
    assert MISSED in found([finding for finding in far if "firat" in finding.about])
    assert MISSED not in found([finding for finding in far if "simplified" in finding.about])


def test_claim_c_is_decided_region_by_region() -> None:
    assert found(_c(grid((1, 1), (6, 1)))) == [HOLDS] * 3
    assert found(_c(grid((6, 1), (1, 1)))) == [MISSED] * 3
    assert found(_c(grid((1, 2), (1, 2)))) == [MISSED] * 3  # no difference is none


def test_claim_d_wants_more_spread_with_few_and_the_same_with_many() -> None:
    assert found(_d(grid((2, 2), (2, 2)))) == [MISSED, HOLDS]
    assert found(_d(grid((2, 9), (2, 1)))) == [HOLDS, MISSED]


def test_claim_e_is_missed_by_one_robot_that_rests() -> None:
    assert found(_e(alone("firat", (0, 0, 100), (0, 0, 100)))) == [HOLDS]
    assert found(_e(alone("firat", (0, 0, 100), (1, 0, 99)))) == [MISSED]


def first(number: int) -> Conditions:
    """So many trials of each cell."""
    whole = grid(simplified=(2, 5), firat=(6, 2))
    return trials({condition: runs[:number] for condition, runs in whole.endings.items()})


def test_one_trial_a_cell_decides_nothing_that_wants_an_interval() -> None:
    findings = [*_c(first(1)), *_d(first(1))]
    assert found(findings) == [OPEN] * 5
    assert findings[0].number.endswith("robots; one trial a cell gives no interval")
    (alone_found,) = _a(alone("simplified", (47, 48, 5)))
    assert alone_found.number == "resting nowhere 5; one trial decides nothing"
    assert alone_found.verdict == OPEN


def test_claim_d_wants_five_trials_a_cell() -> None:
    assert [finding.number for finding in _d(first(4))] == ["fewer than 5 trials in each cell"] * 2
    assert OPEN not in found(_d(first(5)))
    some = first(4).endings | {c: e for c, e in first(8).endings.items() if c.shares[0] == 0.5}
    assert OPEN not in found(_d(trials(some)))


def test_what_has_no_trials_is_open() -> None:
    nothing = trials({})
    for claim in (_a, _b, _c, _d, _e):
        assert set(found(claim(nothing))) == {OPEN}


def test_a_claim_is_as_good_as_its_worst_finding() -> None:
    findings = [
        Finding("a", "", "", HOLDS),
        Finding("a", "", "", MISSED),
        Finding("a", "", "", OPEN),
        Finding("b", "", "", HOLDS),
        Finding("b", "", "", OPEN),
        Finding("c", "", "", HOLDS),
    ]
    assert verdicts(findings) == {"a": MISSED, "b": OPEN, "c": HOLDS}


def test_several_readings_stand_in_a_line_each_with_what_misses_in_bold() -> None:
    def share(number: str, verdict: str) -> list[Finding]:
        return [Finding("a", "share", number, verdict), Finding("b", "trend", "no trials", OPEN)]

    readings = {"reading A": share("5 of 9", MISSED), "count_self true": share("9 of 9", HOLDS)}
    readings["firat_join first_update"] = [Finding("b", "trend", "rises", HOLDS)]
    text = report_text(readings)
    assert "| reading | (a) 1 | (b) 2 | verdicts |" in text
    assert "| reading A | **5 of 9** | no trials | (a) missed, (b) open |" in text
    assert "| count_self true | 9 of 9 | no trials | (a) holds, (b) open |" in text
    assert "| firat_join first_update | no trials | rises | (b) holds |" in text
    assert "(a) 1: share" in text
    assert list(as_dict(readings)["readings"]) == list(readings)
