"""Curves of metrics of one run: over time, with the quartiles of robots where each is recorded."""

import re
from pathlib import Path

import numpy as np
import pytest

from kilotwin.errors import InputError
from kilotwin.metrics.values import MetricValues
from kilotwin.runs.reader import Run
from kilotwin.studies.plot.figures import Wanted, write_figure
from kilotwin.studies.plot.series import draw_run_curve

from ..conftest import SMALL
from ..known_run import ROBOTS, Begin, samples

METRICS = """
[metric.spread]
builtin = "spread"
[metric.heard]
variable = "heard"
per_robot = true
"""


@pytest.fixture
def run(begin: Begin) -> Run:
    """Three samples; of the last robot nothing is known at the second one."""
    writer = begin("run", text=SMALL + METRICS)
    for place, tick in enumerate((0, 61, 122)):
        of_robots = np.arange(ROBOTS, dtype=float)[None] + 10 * place
        if place == 1:
            of_robots[0, -1] = np.nan
        values = {"spread": np.array([0.1 * place]), "heard": np.nanmean(of_robots, axis=1)}
        writer.add(samples([tick]), MetricValues(values, {"heard": of_robots}))
    return Run.open(writer.folder)


def test_a_metric_of_a_run_is_drawn_over_time(run: Run) -> None:
    (axes,) = draw_run_curve(run, "spread").axes
    (line,) = axes.lines
    assert np.asarray(line.get_ydata()).tolist() == pytest.approx([0, 0.1, 0.2])
    assert np.asarray(line.get_xdata())[-1] == pytest.approx(122 * 0.032768, abs=1e-3)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time (s)", "spread (m)")
    assert not axes.collections


def test_where_each_robots_value_is_kept_their_quartiles_are_drawn(run: Run) -> None:
    (axes,) = draw_run_curve(run, "heard").axes
    (band,) = axes.collections
    heights = np.asarray(band.get_paths()[0].vertices)[:, 1]
    known = [np.arange(ROBOTS), np.arange(ROBOTS - 1) + 10, np.arange(ROBOTS) + 20]
    assert heights.min() == pytest.approx(np.percentile(known[0], 25))
    assert heights.max() == pytest.approx(np.percentile(known[2], 75))
    for middle in np.percentile(known[1], [25, 75]):
        assert np.isclose(heights, middle).any()


def test_the_figure_curve_takes_a_run(run: Run, tmp_path: Path) -> None:
    write_figure("curve", run.folder, tmp_path / "a.svg", Wanted(metric="spread"))
    assert "spread (m)" in (tmp_path / "a.svg").read_text()


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        (Wanted(metric="hops"), "--metric hops: .* it has spread, heard, "),
        (Wanted(), "curve: which one? Add --metric"),
        (Wanted(metric="spread", by="swarm.size"), "--by swarm.size: for sweeps; .* is one run"),
        (Wanted(metric="spread", where=("seed=1",)), "--where seed=1: for sweeps"),
    ],
)
def test_what_a_run_cannot_show_is_told(
    wanted: Wanted, said: str, run: Run, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=said.replace("?", re.escape("?"))):
        write_figure("curve", run.folder, tmp_path / "a.svg", wanted)


def test_a_metric_without_a_value_is_told(begin: Begin) -> None:
    writer = begin("run", text=SMALL + METRICS)
    writer.add(samples([0]), MetricValues({"spread": np.array([np.nan])}, {}))
    with pytest.raises(InputError, match="spread has no value in any sample"):
        draw_run_curve(Run.open(writer.folder), "spread")
