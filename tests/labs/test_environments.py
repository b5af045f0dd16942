"""The virtual environments in experiments/environment: what robots do in them, from Python."""

import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from kilotwin import World
from kilotwin.errors import InputError, RunError
from kilotwin.experiment.experiment import Experiment
from kilotwin.studies.pool.series import run_series
from kilotwin.studies.pool.task import Done, Task
from kilotwin.studies.sweep.measure import RESULT, Rows
from kilotwin.studies.sweep.plan import Trial, read_plan
from kilotwin.studies.sweep.runner import Sweep
from kilotwin.units import ticks

ROOT = Path(__file__).parents[2]
WALL = ROOT / "experiments/environment/wall.toml"
PHEROMONE = ROOT / "experiments/environment/pheromone.toml"
WALL_M = 0.2


def distances(world: World, for_s: int) -> "np.ndarray[tuple[int, int], np.dtype[np.floating]]":
    """[seconds, robots]: how far robots are from the middle."""
    rows = []
    for _ in range(for_s):
        world.run(1)
        rows.append(np.hypot(*world.poses[:, :2].T))
    return np.array(rows)


def test_a_wall_of_light_keeps_robots_in() -> None:
    with World(WALL) as world:
        inside = distances(world, 300)
        told = len(world.sent)
        assert {row["type"] for row in world.sent} == {1}
    with World(WALL, set=["environment.missed=1"]) as world:
        free = distances(world, 300)
        assert world.sent == []
    # A robot that walks straight out is told late by delay and pace, then turns on the spot.
    assert inside.max() < WALL_M + 0.06
    assert (inside > WALL_M).mean() < 0.2
    assert (free > WALL_M + 0.06).mean() > 0.3
    assert told > 50


def test_robots_fetch_more_food_with_a_trail_than_without() -> None:
    trips = {}
    for lay in (1.0, 0.0):
        with World(PHEROMONE, set=[f"environment.settings.lay_per_s={lay}"]) as world:
            world.run(700)
            trips[lay] = world.environment.trips
            laid = world.environment.field
        assert (laid.sum() > 0) == (lay > 0)
    # 29 with a trail, 3 without; of the second seed 39 and 6.
    assert trips[1.0] > 3 * trips[0.0]
    assert trips[1.0] > 15


def test_words_come_to_the_robot_that_they_are_for(tmp_path: Path) -> None:
    """The C of ark.h against our packing: each robot shows the word that it was told."""
    (tmp_path / "ark.h").write_bytes((WALL.parent / "ark.h").read_bytes())
    (tmp_path / "shows.c").write_text(
        '#include "ark.h"\n'
        "volatile uint16_t heard_value;\n"
        "volatile uint8_t heard_type;\n"
        "static void on_message(message_t *message, distance_measurement_t *distance) {\n"
        "    ark_word_t word;\n"
        "    (void)distance;\n"
        "    if (!ark_find(message, &word)) return;\n"
        "    heard_type = word.type;\n"
        "    heard_value = word.value;\n"
        "}\n"
        "static void nothing(void) {}\n"
        "int main(void) {\n"
        "    kilo_init();\n"
        "    kilo_message_rx = on_message;\n"
        "    kilo_start(nothing, nothing);\n"
        "    return 0;\n"
        "}\n"
    )
    (tmp_path / "teller.py").write_text(
        "class Teller:\n"
        "    def __init__(self, arena, settings):\n"
        "        pass\n"
        "    def step(self, seen, send):\n"
        "        for robot in seen.robots:\n"
        "            send(robot.uid, 1023 - 41 * robot.uid, robot.uid % 16)\n"
    )
    environment = {"program": str(tmp_path / "teller.py") + ":Teller"}
    with World(
        program=tmp_path / "shows.c", count=20, arena=(1, 1), environment=environment
    ) as world:
        world.run(3)
        for robot in range(20):
            uid = robot + 1
            assert world.variable(robot, "heard_value") == 1023 - 41 * uid
            assert world.variable(robot, "heard_type") == uid % 16


def test_the_same_seed_gives_the_same_however_it_is_stepped() -> None:
    def outcome(steps: list[int], seed: int = 1) -> tuple[str, list[dict[str, object]]]:
        with World(WALL, seed=seed) as world:
            for step in steps:
                world.run_ticks(step)
            return world.result_hash, world.sent

    whole = outcome([1200])
    assert outcome([4] * 50 + [300, 700]) == whole
    assert outcome([1200], seed=2) != whole


def settings_of(trial: Trial) -> list[str]:
    return [f"{key}={value}" for key, value in trial.settings.items()]


def test_a_sweep_gives_the_same_and_runs_again_when_the_program_changed(tmp_path: Path) -> None:
    for file in WALL.parent.iterdir():
        shutil.copy(file, tmp_path)
    sweep_file = tmp_path / "sweep.toml"
    sweep_file.write_text(
        'name = "walls"\nbase = "wall.toml"\n[set]\nduration_s = 20\n'
        "[vary]\nenvironment.settings.radius_m = [0.15, 0.2]\n"
    )

    def prepared(folder: str) -> Sweep:
        return Sweep.prepare(read_plan(sweep_file), tmp_path / folder, lambda _: None)

    sweep = prepared("a")
    outcomes = {}
    for trial, key in sweep.missing():
        (measured,) = run_series([Task(trial.experiment, Rows(), sweep.programs[trial.index])])
        assert isinstance(measured, Done), measured
        part = pa.ipc.open_stream(measured.value)
        outcomes[key] = json.loads(part.schema.metadata[RESULT])["final_hash"]
        with World(WALL, set=["duration_s=20", *settings_of(trial)]) as world:
            world.run_ticks(ticks(20))
            assert world.final_hash == outcomes[key]
    assert len(set(outcomes.values())) == 2
    program = tmp_path / "wall.py"
    program.write_text(program.read_text().replace("SECTORS = 16", "SECTORS = 16.0"))
    assert not set(prepared("b").keys) & set(outcomes)


def test_a_mistake_of_the_program_ends_the_run_with_its_line(tmp_path: Path) -> None:
    (tmp_path / "late.py").write_text(
        "class Late:\n"
        "    def __init__(self, arena, settings):\n"
        "        pass\n"
        "    def step(self, seen, send):\n"
        "        if seen.time_s > 1:\n"
        "            send(99, 0)\n"
    )
    environment = {"program": str(tmp_path / "late.py") + ":Late"}
    with (
        World(program=ROOT / "firmware/blank.c", environment=environment) as world,
        pytest.raises(RunError, match=r"late\.py:6: ValueError: there is no robot with the uid 99"),
    ):
        world.run(3)


def test_a_world_without_an_environment_says_so() -> None:
    with World(program=ROOT / "firmware/blank.c") as world:
        assert world.sent == []
        with pytest.raises(InputError, match=r"there is no environment; give World an \[env"):
            world.environment  # noqa: B018


def test_the_resolved_experiment_means_the_same() -> None:
    loaded = Experiment.load(PHEROMONE)
    program = loaded.resolved()["environment"]["program"]
    assert program == "experiments/environment/pheromone.py:Pheromone"
