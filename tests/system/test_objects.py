"""Objects that robots push, with real programs."""

import itertools
import json
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.colors import to_rgba
from matplotlib.patches import Circle, Polygon

from kilotwin import World
from kilotwin.errors import InputError
from kilotwin.experiment import polygons
from kilotwin.experiment.areas import disc, lies_inside, overlap, polygon_of
from kilotwin.experiment.schema.object import PushedObject
from kilotwin.experiment.spec.objects import areas_at
from kilotwin.runs.palette import OBJECT
from kilotwin.runs.reader import Run
from kilotwin.studies.plot.map import draw_map
from kilotwin.units import TICK_S

from .conftest import KILOTWIN, WALKER, Kilotwin, Program

RADIUS_M = 0.0165
GRAVITY_M_S2 = 9.81
PUSH_N, MASS_KG, SPEED_M_S = 0.001, 0.01, 0.0135
IDEAL = {"speed_m_s": SPEED_M_S, "speed_spread": 0.0, "bias_spread": 0.0, "motor_noise": 0.0}
STRAIGHT = """\
#include <kilolib.h>
static void setup(void) {
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
}
static void loop(void) {}
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
"""
EXPERIMENT = """
name = "objects"
seed = 2
duration_s = 6
[arena]
shape = "rectangle"
width_m = 1
height_m = 1

[[object]]
diameter_m = 0.1
mass_kg = 0.002
friction = 0.02

[[object]]
shape = "polygon"
points_m = [[0, 0], [0.15, 0], [0.15, 0.05], [0.05, 0.05], [0.05, 0.15], [0, 0.15]]
mass_kg = 0.002
pose = [0.2, 0.1, 0.5]

[swarm]
size = 20
program = "program.c"
profile = "kilobot"
start_in_m = [-0.4, -0.4, 0.4, 0.4]

[record]
sample_s = 0.5
"""

LISTENER = """
#include <kilolib.h>
static volatile uint16_t heard;
static volatile uint8_t first, last, type, mm;
static void on_message(message_t *message, distance_measurement_t *distance) {
    heard++;
    first = message->data[0];
    last = message->data[8];
    type = message->type;
    mm = estimate_distance(distance);
}
static void setup(void) {}
static void loop(void) {}
int main(void) {
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


def bar(share: float, pushers: int, mass_kg: float = 0.02, **more: Any) -> dict[str, Any]:
    """An upright bar at the middle, held with a share of what so many robots push with."""
    friction = share * pushers * PUSH_N / (mass_kg * GRAVITY_M_S2)
    return {
        "shape": "rectangle",
        "width_m": 0.02,
        "height_m": 0.3,
        "pose": [0.0, 0.0, 0.0],
        "mass_kg": mass_kg,
        "friction": friction,
        **more,
    }


def side_by_side(count: int) -> list[list[float]]:
    """Poses of robots that touch the bar from the left."""
    return [[-0.01 - RADIUS_M, 0.036 * (i - (count - 1) / 2), 0.0] for i in range(count)]


def in_a_line(count: int) -> list[list[float]]:
    """One behind the other."""
    return [[-0.01 - RADIUS_M * (1 + 2 * i), 0.0, 0.0] for i in range(count)]


def speed(world: World, for_s: float) -> float:
    """The mean velocity of the first object along x."""
    before, began_s = world.objects[0, 0], world.time_s
    world.run(for_s)
    return float(world.objects[0, 0] - before) / (world.time_s - began_s)


@pytest.mark.parametrize("share", [0.3, 0.9, 1.1, 3.0])
@pytest.mark.parametrize("count", [1, 4])
def test_an_object_moves_if_and_only_if_the_robots_beat_the_table(
    program: Program, count: int, share: float
) -> None:
    thing = bar(share, count)
    poses = side_by_side(count)
    with World(program=program(STRAIGHT), poses=poses, motion=IDEAL, object=[thing]) as world:
        world.run(10)
        found = speed(world, 10)
    # A drive's force ends with what its speed lacks: at push * tick it is at its limit.
    balance = SPEED_M_S - share * PUSH_N / MASS_KG * TICK_S
    assert found == pytest.approx(balance if share < 1 else 0, abs=0.02 * SPEED_M_S)


@pytest.mark.parametrize("share", [0.7, 1.1])
def test_a_line_of_ten_pushes_as_ten(program: Program, share: float) -> None:
    thing = bar(share, 10)
    poses = in_a_line(10)
    with World(program=program(STRAIGHT), poses=poses, motion=IDEAL, object=[thing]) as world:
        world.run(10)
        found = speed(world, 6)
    assert found > 0.5 * SPEED_M_S if share < 1 else abs(found) < 0.002 * SPEED_M_S


def test_what_robots_push_with_can_be_set(program: Program) -> None:
    motion = {**IDEAL, "push_n": 3 * PUSH_N}
    for share, moves in ((2.5, True), (3.5, False)):
        with World(
            program=program(STRAIGHT), poses=side_by_side(2), motion=motion, object=[bar(share, 2)]
        ) as world:
            world.run(10)
            assert (speed(world, 5) > 0.2 * SPEED_M_S) == moves


def test_a_push_beside_the_middle_turns_an_object(program: Program) -> None:
    poses = [[-0.01 - RADIUS_M, 0.1, 0.0]]
    thing = bar(0.0, 1, mass_kg=1.0)
    with World(program=program(STRAIGHT), poses=poses, motion=IDEAL, object=[thing]) as world:
        world.run(1)
        headings = []
        for _ in range(3):
            headings.append(float(world.objects[0, 2]))
            world.run_ticks(40)
    inertia = 1.0 * (0.02**2 + 0.3**2) / 12
    # The robot is accelerated too.
    force_n = PUSH_N / (1 + MASS_KG * (0.1**2 / inertia + 1 / 1.0))
    second = (headings[2] - 2 * headings[1] + headings[0]) / (40 * TICK_S) ** 2
    assert second == pytest.approx(-force_n * 0.1 / inertia, rel=0.03)


# One robot alone can push it.
LIGHT = {"mass_kg": 0.002, "friction": 0.02}
THINGS: list[dict[str, Any]] = [
    {"diameter_m": 0.1, **LIGHT},
    {"shape": "rectangle", "width_m": 0.2, "height_m": 0.02, **LIGHT},
    {
        "shape": "polygon",
        "points_m": [[0, 0], [0.15, 0], [0.15, 0.05], [0.05, 0.05], [0.05, 0.15], [0, 0.15]],
        **LIGHT,
    },
    {
        "shape": "joined",
        **LIGHT,
        "part": [
            {"diameter_m": 0.06, "centre_m": [-0.08, 0.0]},
            {"diameter_m": 0.06, "centre_m": [0.08, 0.0]},
            {"shape": "rectangle", "width_m": 0.1, "height_m": 0.01, "heading_rad": 0.0},
        ],
    },
]
CORNERS = [[-0.5, -0.4], [0.5, -0.4], [0.6, 0.4], [0.0, 0.15], [-0.5, 0.4]]
PILLAR = {"centre_m": [0.1, -0.1], "diameter_m": 0.08}


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_objects_find_places_by_the_seed_and_stay_in_the_arena(program: Program, seed: int) -> None:
    keys: dict[str, Any] = {"arena": CORNERS, "obstacle": [PILLAR], "object": THINGS, "seed": seed}
    arena = polygon_of(tuple((x, y) for x, y in CORNERS))
    pillar = disc(0.1, -0.1, 0.08)

    def check(world: World, slack: float) -> None:
        things = [
            areas_at(PushedObject(**thing), [float(value) for value in pose])
            for thing, pose in zip(THINGS, world.objects, strict=True)
        ]
        for parts in things:
            for part in parts:
                assert lies_inside(_smaller(part, slack), arena)
                assert not overlap(_smaller(part, slack), pillar)
        for one, other in itertools.combinations(things, 2):
            for a, b in itertools.product(one, other):
                assert not overlap(_smaller(a, slack), b)
        for x, y, _ in world.poses:
            robot = disc(float(x), float(y), 2 * (RADIUS_M - slack))
            assert not any(overlap(robot, part) for parts in things for part in parts)

    with World(program=program(WALKER), count=25, **keys) as world:
        check(world, 1e-6)
        first = world.objects.copy()
        for _ in range(12):
            world.run(10)
            check(world, 0.1 * RADIUS_M)
        assert np.hypot(*(world.objects - first)[:, :2].T).max() > RADIUS_M
        last = world.final_hash
    with World(program="program.c", count=25, **keys) as world:
        assert (world.objects == first).all()
        for _ in range(12):
            world.run(10)
        assert world.final_hash == last


def _smaller(part: Any, by_m: float) -> Any:
    """A part without its outermost `by_m`."""
    if part.circle:
        return disc(part.x, part.y, part.width - 2 * by_m)
    corners = list(part.outline)
    if sum(a[0] * b[1] - a[1] * b[0] for a, b in polygons.edges(corners)) < 0:
        corners.reverse()
    inner = []
    for i, (x, y) in enumerate(corners):
        before, after = np.array(corners[i - 1]), np.array(corners[(i + 1) % len(corners)])
        into, out = np.array((x, y)) - before, after - np.array((x, y))
        into, out = into / np.hypot(*into), out / np.hypot(*out)
        # Where the lines beside both edges meet, on their left.
        sine = into[0] * out[1] - into[1] * out[0]
        inner.append(tuple(np.array((x, y)) + by_m * (out - into) / sine))
    return polygon_of(tuple(inner))


def test_robots_in_a_rectangle_keep_clear_of_objects(program: Program) -> None:
    thing = {"diameter_m": 0.1, "mass_kg": 0.002, "pose": [0.0, 0.0, 0.0]}
    swarm = {"start_in_m": [-0.1, -0.1, 0.1, 0.1]}
    with World(program=program(WALKER), count=8, object=[thing], swarm=swarm) as world:
        distances = np.hypot(*world.poses[:, :2].T)
        assert distances.min() >= 0.05 + RADIUS_M - 1e-3
        assert np.abs(world.poses[:, :2]).max() < 0.1


def test_an_object_that_finds_no_place_is_named(
    program: Program, tmp_path: Path, kilotwin: Kilotwin
) -> None:
    thing = {"diameter_m": 0.99, "mass_kg": 0.002}
    poses = [[0.0, 0.0, 0.0]]
    with pytest.raises(InputError, match="object 1 finds no free place in the arena"):
        World(program=program(WALKER), poses=poses, object=[thing])
    file = tmp_path / "full.toml"
    file.write_text(EXPERIMENT.replace("diameter_m = 0.1", "diameter_m = 0.99"))
    said = kilotwin("run", file, "--out", tmp_path / "run", expect=2).stderr.splitlines()[-1]
    assert said.endswith(
        "full.toml:10: object 1 finds no free place in the arena: make it smaller "
        "or the arena larger"
    )
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("medium", ["kilobot", "ideal"])
def test_robots_in_range_hear_a_beacon_and_how_far_it_is(program: Program, medium: str) -> None:
    thing = {
        "diameter_m": 0.06,
        "mass_kg": 0.002,
        "pose": [0.0, 0.0, 0.0],
        "beacon": {"type": 7, "data": [5, 0, 0, 0, 0, 0, 0, 0, 9], "period_s": 0.25},
    }
    poses = [[0.05, 0.0, 0.0], [0.0, 0.09, 0.0], [0.2, 0.0, 0.0]]
    keys: dict[str, Any] = {"medium": {"kind": medium, "range_m": 0.1}, "object": [thing]}
    with World(program=program(LISTENER), poses=poses, **keys) as world:
        world.run(60)
        heard = [world.variable(robot, "heard") for robot in range(3)]
        # 8 ticks are 0.26 s.
        assert 220 <= heard[0] <= 230
        assert (140 if medium == "kilobot" else 220) <= heard[1] <= 230
        assert heard[2] == 0
        assert [world.variable(0, name) for name in ("type", "first", "last")] == [7, 5, 9]
        for robot, mm in ((0, 50), (1, 90)):
            assert abs(world.variable(robot, "mm") - mm) <= 8


@pytest.fixture
def recorded(program: Program, tmp_path: Path, kilotwin: Kilotwin) -> Path:
    """The folder of a run in which walkers push two objects."""
    program(WALKER)
    (tmp_path / "objects.toml").write_text(EXPERIMENT)
    out = tmp_path / "run"
    kilotwin("run", tmp_path / "objects.toml", "--out", out, "--plots")
    return out


def test_a_run_records_its_objects_as_often_as_its_robots(recorded: Path) -> None:
    run = Run.open(recorded)
    objects, robots = run.objects(), run.robots()
    assert objects.column_names == ["tick", "time_s", "object", "x_m", "y_m", "heading_rad"]
    assert sorted(set(objects["tick"].to_pylist())) == sorted(set(robots["tick"].to_pylist()))
    assert objects["object"].to_pylist()[:4] == [0, 1, 0, 1]
    assert objects.equals(pq.read_table(recorded / "objects.parquet"))
    first = objects.to_pylist()[1]
    assert (first["x_m"], first["y_m"]) == pytest.approx((0.2, 0.1))
    assert first["heading_rad"] == pytest.approx(0.5)
    with World(recorded / "experiment.toml") as world:
        assert world.objects[0, 0] == objects["x_m"][0].as_py()
        world.run(6)
        last = [row["x_m"] for row in objects.to_pylist()[-2:]]
        assert world.objects[:, 0].tolist() == pytest.approx(last, abs=1e-3)
    assert (recorded / "map.png").stat().st_size > 10_000


def test_a_map_shows_objects_where_they_are_at_the_end(recorded: Path) -> None:
    run = Run.open(recorded)
    (axes,) = draw_map(run).axes
    drawn = [patch for patch in axes.patches if patch.get_facecolor() == to_rgba(OBJECT)]
    round_patch, polygon = drawn
    last = run.objects().to_pylist()[-2:]
    assert isinstance(round_patch, Circle)
    assert round_patch.center == pytest.approx((last[0]["x_m"], last[0]["y_m"]))
    assert isinstance(polygon, Polygon)
    assert polygon.get_xy()[0] == pytest.approx((last[1]["x_m"], last[1]["y_m"]))
    legend = axes.get_legend()
    assert legend is not None
    assert "object (2)" in [text.get_text() for text in legend.get_texts()]


def test_a_repeated_run_is_compared_by_its_objects_too(recorded: Path, kilotwin: Kilotwin) -> None:
    verdict = json.loads(kilotwin("run", "--verify", recorded, "--json").stdout)
    assert verdict["same"] is True
    run = Run.open(recorded)
    assert verdict["rows_compared"] == run.robots().num_rows + run.objects().num_rows
    table = run.objects()
    places = table["y_m"].to_pylist()
    places[5] += 0.001
    other = table.set_column(4, table.field(4), pa.array(places, pa.float32()))
    with (
        pa.OSFile(str(recorded / "objects.arrows"), "wb") as file,
        pa.ipc.new_stream(file, other.schema) as writer,
    ):
        writer.write_table(other)
    verdict = json.loads(kilotwin("run", "--verify", recorded, "--json", expect=1).stdout)
    assert "object 1 has y_m" in verdict["difference"]


def test_a_run_that_is_interrupted_keeps_its_objects(
    program: Program, tmp_path: Path, environment: dict[str, str]
) -> None:
    program(WALKER)
    file = tmp_path / "long.toml"
    file.write_text(EXPERIMENT.replace("duration_s = 6", "duration_s = 1e6"))
    out = tmp_path / "run"
    words = [str(KILOTWIN), "run", str(file), "--out", str(out), "-q"]
    with subprocess.Popen(words, env=environment, stdin=subprocess.DEVNULL) as process:
        end = time.monotonic() + 600
        while not out.exists() or Run.open(out).objects().num_rows < 40:
            assert time.monotonic() < end
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        assert process.wait(600) == 130
    run = Run.open(out)
    assert run.manifest["status"] == "interrupted"
    assert set(run.objects()["tick"].to_pylist()) == set(run.robots()["tick"].to_pylist())
