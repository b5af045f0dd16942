"""The comparison with real walkers: what the grid would have seen, and what is made of it."""

from pathlib import Path

import numpy as np
import pytest
from tests.truth import kilogrid_walk
from tests.truth.kilogrid_walk import (
    Floats,
    cells,
    displacements_cm,
    measure,
    records,
    report_text,
)

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.files.resources import path

from ..conftest import Kilotwin

SIZE = np.array([1.0, 2.0])


def still(place: tuple[float, float], robots: int = 50, seconds: int = 4000) -> Floats:
    time_s = np.arange(0.0, seconds)
    track = np.broadcast_to(np.array(place), (seconds, robots, 2))
    return records(time_s, track, SIZE, np.random.default_rng(1))


def test_cells_are_five_centimetres() -> None:
    own, other = cells(np.array([[0.01, 0.02], [0.5, 1.0], [-0.49, -0.97]]), SIZE)
    assert own == pytest.approx(np.array([[0.025, 0.025], [0.475, 0.975], [-0.475, -0.975]]))
    assert other == pytest.approx(np.array([[-0.025, 0.025], [0.425, 0.975], [-0.425, -0.975]]))


def test_the_nearest_other_cell_is_the_second() -> None:
    _, other = cells(np.array([[0.024, 0.049], [0.024, 0.001], [0.049, 0.03]]), SIZE)
    assert other == pytest.approx(np.array([[0.025, 0.075], [0.025, -0.025], [0.075, 0.025]]))


def test_as_much_is_heard_as_on_the_real_grid() -> None:
    seen = np.isfinite(still((0.02, 0.03))[..., 0])
    attempts = seen.shape[1] * 4000 / 2
    assert seen.any(axis=2).sum() / attempts == pytest.approx(0.55, abs=0.01)
    assert seen.all(axis=2).sum() / seen.sum() == pytest.approx(0.126, abs=0.005)


def test_displacement_is_between_all_records_of_two_seconds() -> None:
    seen = np.full((3, 1, 2, 2), np.nan)
    seen[0, 0] = [[0, 0], [0.05, 0]]
    seen[2, 0, 0] = [0.05, 0.1]
    found = displacements_cm(seen, 2)[0, 0]
    assert sorted(found[np.isfinite(found)]) == pytest.approx([10, np.hypot(5, 10)])


def test_robots_that_stand_are_outside_the_bounds() -> None:
    comparison = measure(still((0.02, 0.03)))
    assert not comparison.within_bounds
    assert comparison.rows[0].emulated["median"] == 0
    assert "OUTSIDE" in report_text(comparison)


def test_straight_walkers_are_measured_rightly() -> None:
    """At large lags cells do not matter: 1 cm/s is 31.5 cm in 30 log seconds."""
    time_s = np.arange(0.0, 400, 0.5)
    x = -2 + 0.01 * time_s
    track = np.stack([np.stack([x, np.full_like(x, y)], -1) for y in np.linspace(0, 0.5, 40)], 1)
    seen = records(time_s, track, np.array([6.0, 2.0]), np.random.default_rng(1))
    found = displacements_cm(seen, 30)
    assert np.nanmean(found) == pytest.approx(31.5, abs=0.6)


def test_only_a_run_with_close_samples_can_be_compared(kilotwin: Kilotwin, folder: Path) -> None:
    kilotwin("run", "small.toml", "--out", "run", "--quiet")
    with pytest.raises(InputError, match=r"it takes a rectangle and record\.sample_s up to 1"):
        kilogrid_walk.compare(folder / "run")


def test_the_experiment_is_made_for_it() -> None:
    keys = Experiment.load(path("experiments/kilogrid/random-walk-100.toml")).keys
    assert (keys.arena.width_m, keys.arena.height_m) == (1, 2)
    assert keys.swarm.size == 100
    assert keys.record.sample_s <= 1


def test_a_run_folder_that_is_none_is_told() -> None:
    with pytest.raises(InputError, match="not a run folder"):
        kilogrid_walk.compare(path("experiments"))
