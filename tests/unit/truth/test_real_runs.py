"""Logs of collective perception are measured, and compared with those of real robots."""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from tests.truth import real_runs
from tests.truth.collective_log import LEAST_SECONDS, Log, Measures, measure, read

from kilotwin.errors import InputError
from kilotwin.table.grid import kilodat
from kilotwin.table.grid.poller import Reports

LOGS = "KILOTWIN_REAL_LOGS"
Row = tuple[int, int, tuple[int, int, int], tuple[int, ...]]
"""Second, robot, module and cell, bytes behind the robot's."""


def write(file: Path, rows: Sequence[Row]) -> Path:
    """A `.kilodat` of these rows and, as its last second, one of robot 9 far away."""
    rows = [*rows, (LEAST_SECONDS - 1, 9, (9, 19, 1), (0, 2, 0, 0, 0, 0))]
    writer = kilodat.Writer(file)
    at_s = (np.array([row[0] for row in rows]) + 0.5) * kilodat.UNIT_S
    x, y, cell = (np.array([row[2][n] for row in rows], dtype=np.uint8) for n in range(3))
    data = np.array([(row[1], *row[3]) for row in rows], dtype=np.uint8)
    writer.add(Reports(at_s, x, y, cell, data))
    writer.close()
    return file


def walk(robot: int, seconds: range, *, state: int = 1, action: int = 1) -> list[Row]:
    """A robot that reports every second from one cell farther up each time, at most 40 of them."""
    return [
        (
            second,
            robot,
            (0, number // 2, 0 if number % 2 else 2),
            (robot % 5, state, action, 0, 0, 0),
        )
        for number, second in enumerate(seconds)
    ]


def measured(tmp_path: Path, rows: Sequence[Row]) -> Measures:
    return measure(read(write(tmp_path / "a.kilodat", rows)))


def test_records_are_counted_per_robot_and_second_in_each_window(tmp_path: Path) -> None:
    found = measured(tmp_path, walk(1, range(20)) + walk(2, range(50, 80)))
    assert found["rate"] == pytest.approx(51 / 3 / LEAST_SECONDS)
    assert found["rate 5-35"] == pytest.approx(15 / 3 / 30)
    assert found["rate 35-65"] == pytest.approx(15 / 3 / 30)
    assert found["rate 65-125"] == pytest.approx(15 / 3 / 60)
    assert found["rate 300-600"] == pytest.approx(1 / 3 / 300)


def test_gaps_are_between_frames_and_two_records_in_one_second_are_one_frame(
    tmp_path: Path,
) -> None:
    seconds = [0, 2, 2, 4, 5, 9, 109, 109, 149]
    rows = [(s, 1, (s % 7, n, 0), (0, 1, 1, 0, 0, 0)) for n, s in enumerate(seconds)]
    found = measured(tmp_path, rows)
    assert found["twice"] == pytest.approx(2 / 8)
    shares = [found[f"gap {gap}"] for gap in (1, 2, 3, 4, 8)]
    assert shares == pytest.approx([1 / 6, 2 / 6, 0, 1 / 6, 0])
    assert found["long gap"] == pytest.approx(70)
    assert found["longest gap"] == 100
    assert found["long gaps"] == pytest.approx(2 / 2 / (LEAST_SECONDS * kilodat.UNIT_S / 3600))


def test_states_and_actions_are_shares_of_the_records(tmp_path: Path) -> None:
    rows = walk(1, range(14)) + walk(2, range(5), state=2, action=2)
    found = measured(tmp_path, rows)
    assert found["dissemination"] == pytest.approx(6 / 20)
    assert found["wall"] == pytest.approx(5 / 20)


def test_displacement_is_between_all_records_of_a_robot_that_far_apart(tmp_path: Path) -> None:
    beside: Row = (4, 1, (2, 0, 2), (1, 1, 1, 0, 0, 0))
    found = measured(tmp_path, [*walk(1, range(40)), beside])
    # A cell a second; the record beside its way pairs with those 4 s before and after.
    squares = [20.0**2] * 36 + [20.0**2, 20.0**2 + 40.0**2]
    assert found["displacement 4"] == pytest.approx(np.sqrt(np.mean(squares)))
    squares = [150.0**2] * 10 + [20.0**2 + 170.0**2]
    assert found["displacement 30"] == pytest.approx(np.sqrt(np.mean(squares)))
    assert found["displacement 300"] == 0


def test_robots_differ_by_their_own_displacement(tmp_path: Path) -> None:
    rows = walk(1, range(40)) + [(s, 2, (3, 3, 0), (1, 1, 1, 0, 0, 0)) for s in range(90)]
    found = measured(tmp_path, rows)
    assert found["slowest"] == 0
    assert found["spread"] == pytest.approx(1)


def test_an_opinion_is_a_robots_until_it_reports_another(tmp_path: Path) -> None:
    rows: list[Row] = []
    for robot in range(4):
        rows += [(0, robot, (robot, 0, 0), (robot, 1, 1, 0, 0, 0))]
        rows += [(100 * (robot + 1), robot, (robot, 0, 0), (3, 1, 1, 0, 0, 0))]
    found = measured(tmp_path, rows)
    assert [found[f"largest at {part}"] for part in (10, 50)] == pytest.approx([1 / 4, 1])
    assert found["largest at 100"] == pytest.approx(4 / 5)  # robot 9 came with another one
    assert found["agreed"] == pytest.approx(300 * kilodat.UNIT_S / 60)
    hours = LEAST_SECONDS * kilodat.UNIT_S / 3600
    assert found["changes"] == pytest.approx(3 / 5 / hours)


def carried() -> Mapping[str, Measures]:
    runs: Mapping[str, Measures] = json.loads(real_runs.FIGURES.read_text())["runs"]
    return runs


def test_the_carried_figures_are_those_of_the_page() -> None:
    """docs/collective_perception.md 2, medians of more runs."""
    middle = {name: float(np.median([run[name] for run in carried().values()])) for name in LIKE}
    assert middle == pytest.approx(LIKE, rel=0.04)


LIKE = {
    "rate": 0.196,
    "rate 5-35": 0.289,
    "rate 35-65": 0.268,
    "rate 65-125": 0.230,
    "rate 300-600": 0.191,
    "twice": 0.124,
    "gap 2": 0.428,
    "gap 4": 0.194,
    "long gap": 86.0,
    "dissemination": 0.042,
    "displacement 4": 5.70,
    "displacement 10": 8.96,
    "displacement 30": 17.0,
    "displacement 120": 32.5,
    "displacement 300": 47.3,
}


def comparison_of(found: Measures) -> real_runs.LogComparison:
    none = np.zeros(0, dtype=np.int64)
    log = Log("it", 3600, 100, none, none, none, none, none, none, none)
    rows = real_runs.rows_of(found, list(carried().values()))
    return real_runs.LogComparison(log, "logs", len(carried()), rows, 7, 2.0)


def test_bounds_hold_a_real_run_and_not_one_that_is_off_everywhere() -> None:
    real = next(iter(carried().values()))
    assert comparison_of(real).within_bounds
    off = comparison_of({name: 0.7 * (value or 0) for name, value in real.items()})
    assert not off.within_bounds
    text = real_runs.report_text(off)
    assert "records per robot and s                            0.136   0.196" in text
    assert "OUTSIDE" in text
    assert "NOT like real runs" in text


def test_one_measure_that_is_far_off_is_enough() -> None:
    real = next(iter(carried().values()))
    found = comparison_of({**real, "dissemination": 0.016})
    assert real_runs.outside(found.rows) <= 3
    assert not found.within_bounds


def test_a_run_that_never_agreed_is_reported_so_and_not_judged() -> None:
    found = {**next(iter(carried().values())), "agreed": float("inf")}
    comparison = comparison_of(found)
    assert comparison.within_bounds
    assert "never" in real_runs.report_text(comparison)
    assert json.dumps(comparison.as_dict(), allow_nan=False)


def test_logs_take_the_place_of_the_carried_figures(tmp_path: Path) -> None:
    files = [
        write(tmp_path / f"{n}.kilodat", walk(1, range(20 + n)) + walk(2, range(50, 80 - n)))
        for n in range(4)
    ]
    found = real_runs.compare(files[0], files[1:])
    assert found.runs == 3
    assert next(row.real for row in found.rows if row.name == "rate") == pytest.approx(
        51 / 3 / LEAST_SECONDS
    )


def test_what_does_not_serve_is_named(tmp_path: Path) -> None:
    good = write(tmp_path / "a.kilodat", walk(1, range(20)))
    with pytest.raises(InputError, match="2 logs do not show how real runs differ; name 3 or more"):
        real_runs.compare(good, [good, good])
    short = tmp_path / "short.kilodat"
    short.write_text("modulex\n1\t1\t0\t5\t1\t1\t0\t2\t1\t0\t0\t0\n")
    with pytest.raises(InputError, match=r"short\.kilodat: 6 log seconds are too short a run"):
        read(short)
    other = tmp_path / "other.kilodat"
    other.write_text("modulex\n1\t1\t0\t900\t1\t1\t0\t9\t1\t0\t0\t0\n")
    with pytest.raises(InputError, match="its reports are not those of collective perception"):
        read(other)
    empty = tmp_path / "empty.kilodat"
    empty.write_text("modulex\n")
    with pytest.raises(InputError, match="holds no reports of robots"):
        read(empty)
    packed = tmp_path / "a.kilodat.xz"
    packed.write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"a\.kilodat\.xz: cannot be read"):
        read(packed)


def logs() -> list[Path]:
    folder = os.environ.get(LOGS)
    return sorted(Path(folder).glob("*.kilodat*")) if folder else []


@pytest.mark.long
def test_the_carried_figures_are_those_of_the_logs() -> None:
    there = {log.name.removesuffix(".xz").removesuffix(".kilodat"): log for log in logs()}
    names = sorted(there.keys() & carried().keys())
    if not names:
        pytest.skip(f"no logs of real robots: {LOGS} names no folder with them")
    for name in names:
        assert measure(read(there[name])) == pytest.approx(carried()[name], rel=1e-4)
