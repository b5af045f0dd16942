"""Figures of any metric draw the table's numbers, with units and numbers of trials."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from kilotwin.errors import InputError
from kilotwin.runs.columns import field
from kilotwin.studies.plot import style
from kilotwin.studies.plot.effects import draw_ecdf, draw_effect, draw_heat
from kilotwin.studies.plot.figures import Wanted, write_figure
from kilotwin.studies.plot.series import draw_curve
from kilotwin.studies.sweep.data_set import ABOUT, SERIES, TRIALS
from kilotwin.studies.sweep.results import Results

SIZES, LOSSES, SEEDS = (10, 20), ("low", "high"), (1, 2, 3)


def value(size: int, loss: str, seed: int) -> float:
    return size * (2 if loss == "high" else 1) + seed


@pytest.fixture
def results(tmp_path: Path) -> Results:
    """Twelve trials: a metric that is 0 at the start, and at the end what `value` says."""
    (tmp_path / ABOUT).write_text(json.dumps({"name": "sizes"}))
    rows = [(n, loss, seed) for n in SIZES for loss in LOSSES for seed in SEEDS]
    trials = {
        "trial": list(range(len(rows))),
        "key": ["k"] * len(rows),
        "base": ["b"] * len(rows),
        "seed": [row[2] for row in rows],
        "swarm.size": [row[0] for row in rows],
        "medium.loss": [row[1] for row in rows],
        "robots": [row[0] for row in rows],
        "metric_hops": [value(*row) for row in rows],
    }
    pq.write_table(pa.table(trials), tmp_path / TRIALS)
    schema = pa.schema(
        [
            ("trial", pa.uint32()),
            ("tick", pa.int64()),
            field("time_s", pa.float64(), "s"),
            field("metric_hops", pa.float64(), "steps"),
            field("metric_gone", pa.float64(), ""),
        ]
    )
    ends = [v for row in rows for v in (0.0, value(*row))]
    columns = [
        np.repeat(np.arange(len(rows), dtype=np.uint32), 2),
        np.tile([0, 305], len(rows)),
        np.tile([0.0, 10.0], len(rows)),
        pa.array(ends),
        pa.nulls(2 * len(rows), pa.float64()),
    ]
    pq.write_table(pa.table(columns, schema=schema), tmp_path / SERIES)
    return Results.open(tmp_path)


def texts(figure: Figure) -> str:
    return " ".join(found.get_text().replace("\n", " ") for found in figure.findobj(Text))


def test_a_curve_is_the_median_of_the_trials_of_one_value(results: Results) -> None:
    column = results.metric("hops")
    figure = style.draw(lambda: draw_curve(results, column, ["swarm.size"]))
    over_time, at_the_end = figure.axes
    lines = {line.get_label(): np.asarray(line.get_ydata()) for line in over_time.lines}
    assert lines["swarm.size 10"][-1] == np.median([11, 12, 13, 21, 22, 23])
    assert [len(np.asarray(line.get_ydata())) for line in at_the_end.lines] == [6, 6]
    said = texts(figure)
    assert "hops (steps), median and quartiles" in said
    assert "6 trials a curve; over all medium.loss" in said


def test_an_effect_has_a_mean_with_its_interval_for_each_value_and_line(results: Results) -> None:
    column = results.metric("hops")
    figure = style.draw(lambda: draw_effect(results, column, "swarm.size", "medium.loss"))
    (axes,) = figure.axes
    found = {bars.get_label(): bars for bars in axes.containers}
    assert set(found) == {"medium.loss low", "medium.loss high"}
    line, _, (intervals,) = found["medium.loss high"]
    assert np.asarray(line.get_ydata()).tolist() == [22, 42]
    assert [segment[:, 1].tolist() for segment in intervals.get_segments()] == [[21, 23], [41, 43]]
    assert "3 trials a point" in texts(figure)


def test_a_heat_map_has_the_median_in_the_cell_of_its_two_values(results: Results) -> None:
    column = results.metric("hops")
    figure = style.draw(lambda: draw_heat(results, column, "swarm.size", "medium.loss"))
    axes = figure.axes[0]
    cells = {found.get_position(): found.get_text() for found in axes.texts}
    rows = [label.get_text() for label in axes.get_yticklabels()]
    columns = [label.get_text() for label in axes.get_xticklabels()]
    assert columns == ["10", "20"]
    assert cells[0, rows.index("low")] == "12"
    assert cells[1, rows.index("high")] == "42"
    assert "hops (steps)" in texts(figure)


def test_a_distribution_goes_from_no_trial_to_all(results: Results) -> None:
    figure = style.draw(lambda: draw_ecdf(results, results.metric("hops"), "swarm.size"))
    line = figure.axes[0].lines[0]
    steps = np.asarray(line.get_xdata()).tolist(), np.asarray(line.get_ydata()).tolist()
    assert steps[0][1:] == [11, 12, 13, 21, 22, 23]
    assert steps[1][-1] == 1


@pytest.mark.parametrize(
    ("figure", "wanted", "said"),
    [
        ("curve", Wanted(), "curve: which one? Add --metric"),
        ("curve", Wanted(metric="hop"), "--metric hop: {folder} has no such metric; it has hops"),
        ("curve", Wanted(metric="hops", x="seed"), "--x seed: not for the figure curve; it takes"),
        ("median", Wanted(metric="hops"), "--metric hops: not for the figure median; it takes"),
        (
            "effect",
            Wanted(x="size", y="hops"),
            "--x size: the sweep does not vary it; it varies swarm.size, medium.loss",
        ),
        ("ecdf", Wanted(metric="gone"), "{folder}: no trial ended with a value of gone"),
        ("heat", Wanted(x="seed", y="base", metric="gone"), "no trial ended with a value of gone"),
    ],
)
def test_what_cannot_be_drawn_says_what_can(
    figure: str, wanted: Wanted, said: str, results: Results, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=re.escape(said.format(folder=results.folder))):
        write_figure(figure, results.folder, tmp_path / "figure.png", wanted)


def test_each_of_them_becomes_a_file(results: Results, tmp_path: Path) -> None:
    write_figure(
        "heat", results.folder, tmp_path / "a.svg", Wanted((), None, "hops", "seed", "base")
    )
    assert "steps" in (tmp_path / "a.svg").read_text()
