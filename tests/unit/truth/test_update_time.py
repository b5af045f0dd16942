"""The verdicts on the claims about the update time, and predictions, on runs made up."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.truth import predictions
from tests.truth.findings import HOLDS, MISSED, OPEN
from tests.truth.update_time import EVEN, NOBODY, TO_BLACK, check

END_S, STEP_S, ROBOTS = 18_000, 600, 50
Shape = Callable[[int], tuple[float, float]]
"""Robots on black and white at a sample."""


def still(black: float, white: float) -> Shape:
    return lambda _: (black, white)


def swinging(by: float) -> Shape:
    return lambda sample: (20 + by * (-1) ** sample, 20 - by * (-1) ** sample)


def data_set(
    folder: Path,
    runs: Sequence[tuple[tuple[int, int], str, Shape]],
    end_s: int = END_S,
    base: str = "their-table",
) -> Path:
    """A sweep's two tables with these runs."""
    folder.mkdir()
    trials = [
        {"trial": trial, "base": base, "seed": 1, "name": name, "robots": ROBOTS}
        | {"robots.1.count": informed[0], "robots.2.count": informed[1]}
        for trial, (informed, name, _) in enumerate(runs)
    ]
    series = [
        {"trial": trial, "time_s": float(time_s)}
        | dict(zip(("metric_black", "metric_white"), map(float, of(sample)), strict=True))
        for trial, (*_, of) in enumerate(runs)
        for sample, time_s in enumerate(range(0, end_s + 1, STEP_S))
    ]
    pq.write_table(pa.Table.from_pylist(trials), folder / "trials.parquet")
    pq.write_table(pa.Table.from_pylist(series), folder / "series.parquet")
    return folder


def cell(
    informed: tuple[int, int], name: str, *outcomes: Shape
) -> list[tuple[tuple[int, int], str, Shape]]:
    return [(informed, name, of) for of in outcomes]


def verdicts(folder: Path) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for finding in check(folder)["their-table"]:
        found.setdefault(finding.claim, []).append(finding.verdict)
    return found


def as_published() -> list[tuple[tuple[int, int], str, Shape]]:
    return [
        *cell(TO_BLACK, "2 s", still(30, 1), still(31, 1), still(32, 1)),
        *cell(TO_BLACK, "8 s", still(31, 10), still(31, 11), still(31, 12)),
        *cell(TO_BLACK, "dynamic", still(48, 1), still(48, 1), still(49, 1)),
        *cell(EVEN, "2 s", swinging(8), swinging(9), swinging(7)),
        *cell(EVEN, "8 s", swinging(1), swinging(2), swinging(1)),
        *cell(NOBODY, "2 s", *[still(20, 18)] * 9),
    ]


def test_claims_hold_of_runs_as_they_were_published(tmp_path: Path) -> None:
    found = verdicts(data_set(tmp_path / "sweep", as_published()))
    assert found == {
        "i": [HOLDS, HOLDS],
        "ii": [HOLDS],
        "iii": [HOLDS, HOLDS],
        "iv": [HOLDS],
        "v": [HOLDS],
    }


def test_claims_are_missed_where_runs_say_the_opposite(tmp_path: Path) -> None:
    other = {"2 s": "8 s", "8 s": "2 s", "dynamic": "dynamic"}
    swapped = [(who, other[name], of) for who, name, of in as_published() if who != NOBODY]
    broken = cell(NOBODY, "2 s", *[still(40, 1)] * 9)
    found = verdicts(data_set(tmp_path / "sweep", [*swapped, *broken]))
    assert found["i"][0] == found["ii"][0] == found["iv"][0] == found["v"][0] == MISSED


def test_few_runs_leave_the_symmetry_open(tmp_path: Path) -> None:
    few = cell(NOBODY, "2 s", *[still(20, 18)] * 4)
    assert verdicts(data_set(tmp_path / "sweep", few))["v"] == [OPEN]


def test_one_run_a_cell_and_cells_without_runs_leave_claims_open(tmp_path: Path) -> None:
    one = [*cell(TO_BLACK, "2 s", still(30, 1)), *cell(TO_BLACK, "8 s", still(31, 9))]
    found = verdicts(data_set(tmp_path / "sweep", one))
    assert found == {
        "i": [OPEN, OPEN],
        "ii": [OPEN],
        "iii": [OPEN, OPEN],
        "iv": [OPEN],
        "v": [OPEN],
    }


def test_short_trials_decide_nothing_and_say_so(tmp_path: Path) -> None:
    folder = data_set(tmp_path / "sweep", as_published(), end_s=3600)
    said: list[str] = []
    findings = check(folder, (), said.append)["their-table"]
    assert {finding.verdict for finding in findings} == {OPEN}
    assert "trials of 3,600 s decide nothing" in said[0]


def test_an_empty_pair_of_stripes_is_even(tmp_path: Path) -> None:
    empty = cell(NOBODY, "2 s", *[still(0, 0)] * 9)
    assert verdicts(data_set(tmp_path / "sweep", empty))["v"] == [HOLDS]


def printed(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> tuple[int, str, str]:
    monkeypatch.setattr("sys.argv", ["predictions", str(folder)])
    code = predictions.main()
    said = capsys.readouterr()
    return code, said.out, said.err


def test_predictions_have_intervals_of_single_runs_and_of_ten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = cell(EVEN, "even split, 10 s", *(still(n, 20) for n in range(1, 21)))
    folder = data_set(tmp_path / "sweep", runs, end_s=3600)
    code, out, _ = printed(folder, monkeypatch, capsys)
    assert code == 0
    lines = out.splitlines()
    assert lines[0] == "**even split, 10 s**, by 20 simulated runs:"
    assert len(lines) == 4 + 6 * 3
    row = lines[4].split("|")
    assert [part.strip() for part in row[1:6]] == ["10", "black", "10.5", "5 to 15", "1 to 19"]
    low, high = map(float, row[6].strip().split(" to "))
    assert 1 < low < 10.5 < high < 19  # narrower than that of one run
    assert lines[5].split("|")[3:7] == [" 20 ", " 20 to 20 ", " 20 to 20 ", " 20 to 20 "]
    assert lines[6].split("|")[2:4] == [" outside ", " 19.5 "]


def test_runs_that_are_too_short_predict_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = data_set(tmp_path / "sweep", cell(EVEN, "x", still(1, 1)), end_s=1800)
    code, _, err = printed(folder, monkeypatch, capsys)
    assert (code, "no sample near 2400 s" in err) == (2, True)


@pytest.mark.parametrize("columns", [(), ("trial", "base")])
def test_another_folder_is_refused_with_what_to_type(
    columns: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if columns:
        for name in ("trials", "series"):
            table = pa.table({column: [0] for column in columns})
            pq.write_table(table, tmp_path / f"{name}.parquet")
    code, _, err = printed(tmp_path, monkeypatch, capsys)
    assert code == 2
    assert "experiments/kilogrid/update-time" in err
