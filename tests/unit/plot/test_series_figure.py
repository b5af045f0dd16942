"""The figure `series` shows a count over time, and at the end, for each kind of trial."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from kilotwin.errors import InputError
from kilotwin.studies.plot import style
from kilotwin.studies.plot.figures import Wanted, write_figure
from kilotwin.studies.plot.series import draw_series
from kilotwin.studies.sweep.data_set import ABOUT, SERIES, TRIALS

# Robots past the gap at 0, 10 and 20 s, by gap and seed.
PAST = {("40 mm", 1): [0, 1, 2], ("40 mm", 2): [0, 3, 4], ("80 mm", 1): [0, 9, 20]}


def sweep(folder: Path, **more: list[Any]) -> Path:
    folder.mkdir()
    (folder / ABOUT).write_text(json.dumps({"name": "gaps"}))
    gaps, seeds = zip(*PAST, strict=True)
    number = list(range(len(PAST)))
    columns = {"trial": number, "seed": seeds, "obstacle.1.centre_m": gaps, "robots": [20] * 3}
    pq.write_table(pa.table({**columns, **more}), folder / TRIALS)
    rows = {
        "trial": np.repeat(np.array(number, dtype=np.uint32), 3),
        "tick": np.tile([0, 305, 610], 3),
        "time_s": np.tile([0.0, 10.0, 20.0], 3),
        "state_past": np.concatenate(list(PAST.values())).astype(np.uint32),
    }
    pq.write_table(pa.table(rows), folder / SERIES)
    return folder


def heights(line: Line2D) -> list[float]:
    return [float(y) for y in np.asarray(line.get_ydata())]


def drawn(folder: Path, *where: str) -> Figure:
    return style.draw(lambda: draw_series(folder, where, "state_past"))


def test_medians_are_drawn_over_time_by_what_varies(tmp_path: Path) -> None:
    over_time, _ = drawn(sweep(tmp_path / "sweep")).axes
    lines = {line.get_label(): heights(line) for line in over_time.lines}
    assert lines == {
        "obstacle.1.centre_m 40 mm": [0, 2, 3],
        "obstacle.1.centre_m 80 mm": [0, 9, 20],
    }


def test_the_end_shows_each_trial_and_the_median(tmp_path: Path) -> None:
    _, at_the_end = drawn(sweep(tmp_path / "sweep")).axes
    assert [sorted(heights(line)) for line in at_the_end.lines] == [[2, 4], [20]]
    medians = [
        float(segment[0][1])
        for found in at_the_end.collections
        if isinstance(found, LineCollection)
        for segment in found.get_segments()
    ]
    assert medians == [3, 20]


def test_a_name_that_varies_says_which_trials_they_are(tmp_path: Path) -> None:
    folder = sweep(tmp_path / "sweep", name=["gap of 40 mm", "gap of 40 mm", "gap of 80 mm"])
    over_time, _ = drawn(folder).axes
    assert [line.get_label() for line in over_time.lines] == ["gap of 40 mm", "gap of 80 mm"]


def test_trials_are_chosen_as_for_other_figures(tmp_path: Path) -> None:
    over_time, _ = drawn(sweep(tmp_path / "sweep"), "seed=2").axes
    (line,) = over_time.lines
    assert line.get_label() == "all trials"
    assert heights(line) == [0, 3, 4]


def test_trials_that_differ_too_much_are_refused(tmp_path: Path) -> None:
    folder = sweep(tmp_path / "sweep")
    table = pa.table({"trial": range(13), "seed": [1] * 13, "swarm.size": range(1, 14)})
    pq.write_table(table, folder / TRIALS)
    said = r"13 kinds of trials, and one figure can tell 12 apart.*--where swarm.size=1"
    with pytest.raises(InputError, match=said):
        drawn(folder)


@pytest.mark.parametrize(
    ("figure", "column", "said"),
    [
        ("series", None, "which column? Add --column; {folder} has state_past"),
        ("series", "past", "--column past: {folder} has no such metric; it has state_past"),
        ("error", "past", "--column past: for the figure series; error has none"),
    ],
)
def test_a_column_that_is_not_there_is_refused(
    figure: str, column: str | None, said: str, tmp_path: Path
) -> None:
    folder = sweep(tmp_path / "sweep")
    with pytest.raises(InputError, match=re.escape(said.format(folder=folder))):
        write_figure(figure, folder, tmp_path / "figure.png", Wanted(column=column))


def test_a_folder_without_trials_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no sweep's folder with finished trials"):
        draw_series(tmp_path, (), "state_past")
