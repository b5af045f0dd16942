"""The comparison of what cells hear with a real grid: what is counted, and the emulated grid."""

from pathlib import Path

import numpy as np
import pytest
from tests.truth import kilogrid_uplink

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.experiment.text import Setting
from kilotwin.files.resources import path
from kilotwin.session import run
from kilotwin.session.display import Silent

LOG_SECOND_S = 32 * 0.032768


def measured(seconds: list[float], robot: int = 0) -> kilogrid_uplink.UplinkComparison:
    time_s = np.array(seconds) * LOG_SECOND_S
    return kilogrid_uplink.measure(time_s, np.full(len(time_s), robot), robots=1, duration_s=1000.0)


def test_gaps_are_counted_in_whole_log_seconds() -> None:
    found = measured([0.1, 2.1, 4.2, 8.3, 14.1, 22.9, 25.5])
    assert found.gaps == {2: 2 / 6, 4: 1 / 6, 6: 1 / 6, 8: 1 / 6}
    assert found.rate == pytest.approx(7 / 1000)
    assert found.doubles == 0


def test_two_records_of_a_robot_within_a_second_are_one_frame_heard_twice() -> None:
    found = measured([0.1, 0.2, 2.1, 4.1, 4.9])
    assert found.doubles == pytest.approx(2 / 5)


def test_gaps_are_between_records_of_the_same_robot() -> None:
    time_s = np.array([0.0, 1.0, 2.1, 3.1]) * LOG_SECOND_S
    found = kilogrid_uplink.measure(time_s, np.array([0, 1, 0, 1]), robots=2, duration_s=1000.0)
    assert found.gaps[2] == 1
    assert found.doubles == 0


def test_peaks_that_fall_by_the_same_factor_have_that_ratio() -> None:
    seconds = [0.0]
    for gap, times in ((2, 64), (4, 32), (6, 16), (8, 8)):
        for _ in range(times):
            seconds.append(seconds[-1] + gap)
    assert measured([second + 0.5 for second in seconds]).ratio == pytest.approx(0.5)


def test_a_short_run_is_refused() -> None:
    with pytest.raises(InputError, match="too short"):
        kilogrid_uplink.measure(np.array([1.0]), np.array([0]), robots=1, duration_s=100.0)


def test_the_bounds_are_those_of_the_real_logs() -> None:
    def comparison(**change: float) -> kilogrid_uplink.UplinkComparison:
        gaps = {2: 0.37, 4: 0.17, 6: 0.074, 8: change.pop("eighth", 0.031)}
        values = {"rate": 0.2, "doubles": 0.126, **change}
        return kilogrid_uplink.UplinkComparison(
            robots=100,
            records=1,
            duration_s=3600.0,
            gaps=gaps,
            mean_gap_s=5.0,
            p99_gap_s=60.0,
            longest_gap_s=400.0,
            **values,
        )

    assert comparison().within_bounds
    assert comparison(rate=0.28).within_bounds
    assert not comparison(doubles=0.08).within_bounds
    assert not comparison(eighth=0.039).within_bounds
    assert "within bounds" in kilogrid_uplink.report_text(comparison())
    assert "OUTSIDE" in kilogrid_uplink.report_text(comparison(doubles=0.2))


def uplink(
    folder: Path, seed: int, robots: int, duration_s: float
) -> kilogrid_uplink.UplinkComparison:
    settings = [
        Setting((key,), value, f"{key}={value}")
        for key, value in (("seed", seed), ("duration_s", duration_s))
    ]
    settings.append(Setting(("swarm", "size"), robots, f"swarm.size={robots}"))
    experiment = Experiment.load(path("experiments/kilogrid/uplink-100.toml"), settings)
    run.run(experiment, folder, ["kilotwin", "run"], Silent())
    return kilogrid_uplink.compare(folder)


def test_an_emulated_grid_hears_robots_as_the_real_one_did(tmp_path: Path) -> None:
    # 50 robots, 400 s: some 5,000 records. Walkers that only report are heard more often.
    found = uplink(tmp_path / "run", 1, 50, 400.0)
    assert found.rate == pytest.approx(0.28, abs=0.05)
    assert found.doubles == pytest.approx(0.126, abs=0.05)
    assert found.ratio == pytest.approx(0.45, abs=0.09)
    assert found.gaps[2] == pytest.approx(0.37, rel=0.25)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_hour_of_the_full_grid_hears_as_the_real_one_but_for_long_gaps(
    tmp_path: Path, seed: int
) -> None:
    found = uplink(tmp_path / "run", seed, 100, 3600.0)
    assert found.ratio == pytest.approx(0.45, abs=0.07)
    assert found.doubles == pytest.approx(0.126, abs=0.04)
    for gap, real in {2: 0.37, 4: 0.17, 6: 0.074}.items():
        assert found.gaps[gap] == pytest.approx(real, rel=0.25)
