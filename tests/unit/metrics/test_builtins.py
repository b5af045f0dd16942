"""Built-in metrics, against figures that can be worked out by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kilotwin.experiment.areas import area_of
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import parse_setting
from kilotwin.metrics import geometry
from kilotwin.metrics.builtins import Coverage, mean_distance, order, spread
from kilotwin.metrics.meter import Meter

from ..conftest import SMALL, Load

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def test_distances_and_areas_of_a_square_are_known() -> None:
    assert mean_distance(SQUARE) == pytest.approx((4 + 2 * math.sqrt(2)) / 6)
    assert spread(SQUARE) == pytest.approx(math.sqrt(0.5))
    assert geometry.hull_area()(SQUARE) == pytest.approx(1.0)


def test_points_on_a_line_have_no_area_and_no_points_have_no_spread() -> None:
    assert geometry.hull_area()(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])) == 0
    assert geometry.hull_area()(SQUARE[:2]) == 0
    assert spread(SQUARE[:0]) is None
    assert mean_distance(SQUARE[:1]) is None
    assert order(np.array([])) is None


@given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), max_size=40))
def test_clusters_are_those_of_a_search_from_neighbour_to_neighbour(
    places: list[tuple[int, int]],
) -> None:
    left, sizes = list(places), []
    while left:
        reached, grown = [left.pop()], 0
        while grown < len(reached):
            near = [p for p in left if math.dist(p, reached[grown]) <= 3]
            for point in near:
                left.remove(point)
            reached += near
            grown += 1
        sizes.append(len(reached))
    points = np.array(places, dtype=float).reshape(-1, 2)
    assert sorted(geometry.cluster_sizes(3.0)(points)) == sorted(sizes)


def test_mean_distance_does_not_depend_on_how_many_rows_are_in_memory() -> None:
    points = np.random.default_rng(1).uniform(size=(2500, 2))
    away = [np.hypot(*(points[i + 1 :] - points[i]).T).sum() for i in range(len(points))]
    assert mean_distance(points) == pytest.approx(sum(away) * 2 / (2500 * 2499))


def test_order_is_one_if_all_face_one_way_and_nothing_if_they_cancel() -> None:
    assert order(np.full(5, 2.0)) == pytest.approx(1)
    assert order(np.array([0.0, math.pi / 2, math.pi, 3 * math.pi / 2])) == pytest.approx(0)


def test_coverage_adds_up_the_squares_in_which_robots_were(load: Load) -> None:
    arena = load(SMALL, "arena={shape='rectangle',width_m=4.0,height_m=2.0}").keys.arena
    seen = Coverage(area_of(arena), 1.0)
    assert seen.with_points(np.array([[-1.5, -0.5], [-1.4, -0.4]])) == pytest.approx(1 / 8)
    assert seen.with_points(np.array([[1.5, 0.5]])) == pytest.approx(2 / 8)
    assert seen.with_points(np.array([[2.0, 1.0]])) == pytest.approx(2 / 8), "at the wall"


def measured(experiment: Experiment, name: str) -> list[float]:
    """Two samples of ten robots: in the first all on black, walking; then half at rest."""
    x = np.linspace(-1.2, -0.8, 10, dtype=np.float32)
    leds = np.zeros((2, 10), dtype=np.uint8)
    leds[1, :5] = 63
    samples = {
        "tick": np.array([0, 305]),
        "x_m": np.stack([x, x]),
        "y_m": np.zeros((2, 10), dtype=np.float32),
        "heading_rad": np.zeros((2, 10), dtype=np.float32),
        "led": leds,
        "site": np.ones((2, 10), dtype=np.uint8),
    }
    values = Meter(experiment, None).measure(samples, None).values  # type: ignore[arg-type]
    return list(values[name])


STATES = "states={resting='bright-white',walking='off'}"


@pytest.mark.parametrize(
    ("metric", "values"),
    [
        ("{builtin='share',state='resting'}", [0, 0.5]),
        ("{builtin='number',state='walking',site='black'}", [10, 5]),
        ("{builtin='number',site='white'}", [0, 0]),
        ("{builtin='number',region={centre_m=[-1.2,0.0],diameter_m=0.1}}", [2, 2]),
        ("{builtin='messages'}", [math.nan, math.nan]),
    ],
)
def test_a_metric_is_about_the_robots_that_are_chosen(
    load: Load, metric: str, values: list[float]
) -> None:
    experiment = load(SMALL, f"metric.mine={metric}", STATES)
    assert measured(experiment, "mine") == pytest.approx(values, nan_ok=True)


def test_first_time_is_the_time_of_the_sample_at_which_the_other_metric_got_there(
    load: Load,
) -> None:
    rest = "metric.rest={builtin='share',state='resting'}"
    first = "metric.first={builtin='first_time',metric='rest',at_least=0.5}"
    never = "metric.never={builtin='first_time',metric='rest',at_least=0.6}"
    experiment = load(SMALL, rest, first, never, STATES)
    assert measured(experiment, "first") == pytest.approx([math.nan, 305 * 0.032768], nan_ok=True)
    assert np.isnan(measured(experiment, "never")).all()


def test_metrics_survive_the_run_folder(load: Load, tmp_path: Path) -> None:
    """The resolved experiment has every key, and loads to the same."""
    given = (
        "metric.rest={builtin='clusters',within_m=0.1,region={centre_m=[0.0,0.0],diameter_m=1.0}}"
    )
    experiment = load(SMALL, given)
    (tmp_path / "again.toml").write_text(experiment.to_toml())
    again = Experiment.load(tmp_path / "again.toml", [parse_setting("seed=1")])
    assert again.keys.metric == experiment.keys.metric
