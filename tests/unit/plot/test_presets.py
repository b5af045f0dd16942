"""The paper's figures come out of the figures of any sweep, with the numbers of its own."""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kilotwin.errors import InputError
from kilotwin.runs.columns import field
from kilotwin.studies.plot import style
from kilotwin.studies.plot.effects import STATISTICS, draw_heat
from kilotwin.studies.plot.figures import Wanted, write_figure
from kilotwin.studies.plot.presets import PRESETS, with_preset
from kilotwin.studies.plot.sweep import quartile_range
from kilotwin.studies.sweep.conditions import Conditions, on_site
from kilotwin.studies.sweep.data_set import ABOUT, SERIES, TRIALS
from kilotwin.studies.sweep.results import Results

BASES = {"simplified-n50": ("simplified", 50), "firat-n50": ("firat", 50)}
SHARES, INFORMED, SEEDS = (0.5, 1.0), (0.1, 0.3), (1, 2, 3, 4)


@pytest.fixture
def grid(tmp_path: Path) -> Path:
    """A small data set as experiments/paper/grid.toml makes it: 36 trials, 4 without informed."""
    chance = np.random.default_rng(1)
    rows = [
        (base, informed, share, seed)
        for base in BASES
        for informed, share in [*((i, s) for i in INFORMED for s in SHARES), (0.0, None)]
        for seed in SEEDS
    ]
    black = [int(number) for number in chance.integers(0, 50, len(rows))]
    (tmp_path / ABOUT).write_text(json.dumps({"name": "grid"}))
    trials = {
        "trial": list(range(len(rows))),
        "key": ["k"] * len(rows),
        "base": [row[0] for row in rows],
        "seed": [row[3] for row in rows],
        "swarm.informed": [row[1] for row in rows],
        "swarm.informed_for.black": [row[2] for row in rows],
        "swarm.informed_for.white": [None if row[2] is None else 1 - row[2] for row in rows],
        "robots": [BASES[row[0]][1] for row in rows],
        "resting_black": black,
        "resting_white": [50 - number for number in black],
        "not_resting": [0] * len(rows),
        "rule": [BASES[row[0]][0] for row in rows],
        "reading": ["reading A"] * len(rows),
        "informed": [row[1] for row in rows],
        "share_black": [row[2] or 0.0 for row in rows],
        "share_white": [0.0 if row[2] is None else 1 - row[2] for row in rows],
        "result_hash": ["0"] * len(rows),
    }
    pq.write_table(pa.table(trials), tmp_path / TRIALS)
    names = ("resting_black", "resting_white")
    schema = pa.schema(
        [
            ("trial", pa.uint32()),
            ("tick", pa.int64()),
            field("time_s", pa.float64(), "s"),
            *(field(name, pa.uint32(), "robots") for name in names),
        ]
    )
    columns: list[Iterable[Any]] = [range(len(rows)), [915_527] * len(rows), [30_000.0] * len(rows)]
    columns += [black, [50 - number for number in black]]
    arrays = [pa.array(list(c), f.type) for c, f in zip(columns, schema, strict=True)]
    pq.write_table(pa.table(arrays, schema=schema), tmp_path / SERIES)
    return tmp_path


@pytest.mark.parametrize("site", ["black", "white"])
@pytest.mark.parametrize(("name", "of"), [("median", median), ("iqr", quartile_range)])
def test_each_cell_of_a_preset_has_the_number_of_the_papers_own_figure(
    name: str, of: Callable[[Sequence[int]], float], site: str, grid: Path
) -> None:
    wanted = PRESETS[f"paper-{name}-{site}"].wanted
    assert wanted.x is not None
    assert wanted.y is not None
    results = Results.open(grid)
    figure = style.draw(
        lambda: draw_heat(
            results,
            results.metric(f"resting_{site}"),
            str(wanted.x),
            str(wanted.y),
            panels=wanted.panels,
            statistic=str(wanted.statistic),
        )
    )
    panels = {axes.get_title("left"): axes for axes in figure.axes if axes.get_title("left")}
    assert set(panels) == set(BASES)
    conditions = Conditions.open(grid)
    for base, (rule, _) in BASES.items():
        cells = conditions.where(rule=rule)
        (image,) = panels[base].get_images()
        shown = np.asarray(image.get_array())
        for y, informed in enumerate(INFORMED):
            for x, share in enumerate(SHARES):
                (endings,) = (
                    runs
                    for condition, runs in cells.items()
                    if (condition.informed, condition.shares[0]) == (informed, share)
                )
                robots = on_site(endings, ("black", "white").index(site))
                assert len(robots) == len(SEEDS)
                assert shown[y, x] == of(robots)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_draws(name: str, grid: Path, tmp_path: Path) -> None:
    figure = PRESETS[name].figure
    wanted = with_preset(name, figure, Wanted())
    write_figure(figure, grid, tmp_path / "figure.svg", wanted)
    assert (tmp_path / "figure.svg").stat().st_size > 1000


def test_options_that_are_given_are_taken_before_a_presets() -> None:
    given = Wanted(where=("seed=1",), statistic="mean")
    wanted = with_preset("paper-median-black", "heat", given)
    assert (wanted.statistic, wanted.metric, wanted.where) == ("mean", "resting_black", ("seed=1",))
    assert with_preset("paper-symmetry", "ecdf", given).where == ("swarm.informed=0", "seed=1")


def test_a_wrong_preset_is_told() -> None:
    with pytest.raises(InputError, match="no such preset; there are paper-median-black"):
        with_preset("paper", "heat", Wanted())
    with pytest.raises(InputError, match="a preset of heat; type: kilotwin plot heat"):
        with_preset("paper-median-black", "ecdf", Wanted())


def test_statistics_of_one_trial() -> None:
    assert [STATISTICS[name]([3.0]) for name in ("median", "mean")] == [3.0, 3.0]
    assert np.isnan(STATISTICS["iqr"]([3.0]))
