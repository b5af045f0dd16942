"""[record] chooses what a run folder holds; who needs what was left out is told so."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from kilotwin.errors import InputError
from kilotwin.experiment.experiment import Experiment
from kilotwin.runs.reader import Run
from kilotwin.runs.size import bytes_of, bytes_text, size_of
from kilotwin.runs.writer import RunWriter
from kilotwin.studies.plot.figures import write_figure

from ..conftest import SMALL, Kilotwin, Load
from ..known_run import samples as known_samples
from .test_folder import ROBOTS, some_samples


def recorded(folder: Path, experiment: Experiment, samples: int = 12, step: int = 3) -> Run:
    writer = RunWriter(folder, experiment, {"status": "finished"})
    for first in range(0, samples, step):
        writer.add(some_samples(first, min(step, samples - first)))
    writer.close(clean=True)
    return Run.open(folder)


def test_columns_that_are_left_out_are_in_no_file(load: Load, tmp_path: Path) -> None:
    run = recorded(tmp_path / "run", load(SMALL, 'record.columns=["state","y_m"]'))
    names = ["tick", "time_s", "robot", "y_m", "state"]
    assert run.robots().column_names == names
    assert pq.read_table(tmp_path / "run/robots.parquet").equals(run.robots())
    whole = recorded(tmp_path / "whole", load()).robots()
    assert run.robots().equals(
        whole.select(names).replace_schema_metadata(run.robots().schema.metadata)
    )


def test_what_is_recorded_besides_is_of_the_same_robots_and_samples(
    load: Load, tmp_path: Path
) -> None:
    settings = ('record.also=["battery","messages"]', "record.robots=[7,2]", "record.robots_s=30")
    experiment = load(f"{SMALL}\n[controller]\n", *settings)
    writer = RunWriter(tmp_path / "run", experiment, {"status": "finished"})
    some, known = some_samples(0, 12), known_samples(range(12), extras=True)
    some["battery"], some["sent"], some["received"], some["delivered"] = (
        known["battery"],
        known["sent"],
        known["received"],
        known["delivered"],
    )
    some["delivered"][:, 7] = 2**32 - 1  # a chip's is not known
    writer.add(some)
    writer.close(clean=True)
    rows = Run.open(tmp_path / "run").robots()
    assert rows.column_names[-4:] == ["battery", "sent", "received", "delivered"]
    written = [0, 3, 6, 9, 11]  # the last moment in any case
    assert rows["sent"].to_pylist() == known["sent"][written][:, [2, 7]].ravel().tolist()
    delivered = known["delivered"][written][:, 2].tolist()
    assert rows["delivered"].to_pylist() == [of for one in delivered for of in (one, None)]
    assert rows["battery"].to_pylist() == known["battery"][written][:, [2, 7]].ravel().tolist()


@pytest.mark.parametrize(
    ("setting", "chosen"),
    [
        ("record.robots=[7,2]", [2, 7]),
        ("record.robots_count=4", [0, 2, 5, 7]),
        ("record.robots_count=99", list(range(ROBOTS))),
        ("record.robots_share=0.2", [0, 5]),
        ("record.robots_share=0", []),
    ],
)
def test_robots_are_chosen_by_index_number_or_share(
    setting: str, chosen: list[int], load: Load, tmp_path: Path
) -> None:
    run = recorded(tmp_path / "run", load(f"{SMALL}\n[controller]\n", setting), step=12)
    rows, whole = run.robots(), some_samples(0, 12)
    assert rows["robot"].to_pylist() == chosen * 12
    assert rows["x_m"].to_pylist() == whole["x_m"][:, chosen].ravel().tolist()
    assert run.sites()["not_resting"].to_pylist() == [7] * 12  # counts are of all robots


@pytest.mark.parametrize("step", [1, 3, 12])
def test_robots_are_written_at_their_own_rate_with_begin_and_end(
    step: int, load: Load, tmp_path: Path
) -> None:
    run = recorded(tmp_path / "run", load(SMALL, "record.robots_s=40"), step=step)
    assert np.unique(run.robots()["tick"]).tolist() == [0, 4 * 305, 8 * 305, 11 * 305]
    assert run.sites().num_rows == 12


def test_rows_at_the_rate_of_samples_are_never_skipped(load: Load, tmp_path: Path) -> None:
    """Samples are taken at whole ticks, so that after hours they come a sample early."""
    run = recorded(tmp_path / "run", load(SMALL, "record.robots_s=10"), samples=2000, step=50)
    assert len(np.unique(run.robots()["tick"])) == 2000


def test_rounded_poses_are_as_near_as_promised_and_take_less_room(
    load: Load, tmp_path: Path
) -> None:
    def written(name: str, *settings: str) -> tuple[Run, int]:
        writer = RunWriter(tmp_path / name, load(SMALL, *settings), {"status": "finished"})
        samples = some_samples(0, 100)
        chance = np.random.default_rng(1)
        for axis in ("x_m", "y_m", "heading_rad"):
            samples[axis] = chance.uniform(-2, 2, samples["led"].shape).astype(np.float32)
        writer.add(samples)
        writer.close(clean=True)
        return Run.open(tmp_path / name), bytes_of(tmp_path / name)

    exact, exact_bytes = written("exact")
    rounded, rounded_bytes = written("rounded", "record.precision_m=0.001")
    for name, bound in (("x_m", 0.001), ("y_m", 0.001), ("heading_rad", 0.001 / 0.085)):
        before, now = (np.asarray(run.robots()[name]) for run in (exact, rounded))
        assert 0 < np.abs(before - now).max() <= bound / 2
    assert rounded_bytes < 0.9 * exact_bytes


def test_who_needs_a_column_that_was_left_out_says_which(load: Load, tmp_path: Path) -> None:
    columns = 'record.columns=["x_m","y_m"]'
    recorded(tmp_path / "run", load(SMALL, columns))
    with pytest.raises(InputError, match=r"record\.columns left out heading_rad"):
        write_figure("map", tmp_path / "run", tmp_path / "map.png")
    recorded(tmp_path / "none", load(SMALL, "record.robots_count=0"))
    with pytest.raises(InputError, match=r"\[record\] chose no robots"):
        write_figure("map", tmp_path / "none", tmp_path / "map.png")


def test_figures_of_states_and_the_map_take_runs_with_part_of_the_robots(
    load: Load, tmp_path: Path
) -> None:
    settings = ("record.robots=[2,4]", "record.robots_s=60")
    recorded(tmp_path / "run", load(f"{SMALL}\n[controller]\n", *settings))
    write_figure("map", tmp_path / "run", tmp_path / "map.svg")
    assert "2 of 10 robots" in (tmp_path / "map.svg").read_text()
    write_figure("states", tmp_path / "run", tmp_path / "states.svg")
    shown = (tmp_path / "states.svg").read_text()
    assert "resting (3)" in shown  # of all ten
    assert "walking (7)" in shown


def test_an_experiment_without_record_keys_means_what_it_did(load: Load) -> None:
    assert set(load().resolved()["record"]) == {"sample_s", "can_log", "prints_per_robot", "prints"}


def test_the_size_is_told_before_the_run_and_without_it(kilotwin: Kilotwin, folder: Path) -> None:
    done = kilotwin("run", "small.toml", "--dry-run", "--set", "record.robots_s=60")
    assert done.stdout == "records about 21 kB: 20 rows of robots\n"
    assert not (folder / "runs").exists()
    done = kilotwin("run", "small.toml", "--out", "run")
    assert "records about 22 kB: 70 rows of robots\n" in done.stderr


@pytest.mark.parametrize(
    ("settings", "rows"),
    [
        ((), 10 * 361),
        (("record.robots_s=60",), 10 * 61),
        (("record.robots_s=70",), 10 * 53),
        (("record.robots_share=0.1",), 361),
        (("record.sample_s=7",), 10 * 516),
    ],
)
def test_the_estimate_counts_the_rows_that_are_written(
    settings: tuple[str, ...], rows: int, load: Load
) -> None:
    assert size_of(load(SMALL, "duration_s=3600", *settings).keys).rows == rows


def test_the_estimate_is_smaller_the_less_is_recorded(load: Load) -> None:
    keys = ("record.precision_m=0.001", 'record.columns=["x_m"]', "record.robots_count=1")
    whole = size_of(load().keys).estimated_bytes
    assert all(size_of(load(SMALL, key).keys).estimated_bytes < whole for key in keys)


def test_a_full_disk_is_seen_before_the_run(load: Load, tmp_path: Path) -> None:
    size = size_of(load().keys)
    assert size.without_room(tmp_path / "run") is None
    huge = size_of(load(SMALL, "duration_s=1e9", "record.sample_s=0.04").keys)
    assert "let [record] choose less" in str(huge.without_room(tmp_path / "a/b"))


def test_bytes_are_told_with_two_digits() -> None:
    told = [bytes_text(count) for count in (400, 1234, 45_678, 9_900_000, 1.35e9, 2e15)]
    assert told == ["0.4 kB", "1.2 kB", "46 kB", "9.9 MB", "1.4 GB", "2,000,000 GB"]
