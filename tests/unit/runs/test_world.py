"""The Python API, with the real engine; and its document, whose test is run as it stands."""

import math
import re
import runpy
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kilotwin import RGB, World
from kilotwin.errors import InputError, RunError

from ..conftest import BLINK, SMALL

ROOT = Path(__file__).parents[3]

TALKER = """\
#define DEBUG
#include <kilolib.h>
#include <debug.h>
#include <stdbool.h>

enum mood { CALM, EXCITED };
static struct {
    int8_t low;
    uint16_t many[2][2];
    float real;
    enum mood mood;
    bool yes;
    unsigned narrow : 3, wide : 5;
} all = {-5, {{1, 2}, {3, 500}}, 2.5f, EXCITED, true, 5, 17};
static volatile uint8_t heard;
static volatile uint8_t heard_type;

static void on_message(message_t *message, distance_measurement_t *distance) {
    (void)distance;
    heard = message->data[1];
    heard_type = message->type;
}

static void setup(void) {
    static volatile int steps = 1;
    steps++;
    all.low--;
    printf("uid %d\\n", kilo_uid);
    printf("half a ");
    printf("line\\n");
    all.many[0][0] += all.narrow + all.wide + all.yes + all.mood + (int)all.real;
}

static void loop(void) {
    static volatile int steps = 7;
    (void)steps;
    set_motors(kilo_straight_left, 12);
    set_color(RGB(1, 2, 3));
}

int main(void) {
    debug_init();
    kilo_message_rx = on_message;
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("world")
    (folder / "talker.c").write_text(TALKER)
    (folder / "blink.c").write_text(BLINK)
    (folder / "small.toml").write_text(SMALL)
    return folder


@pytest.fixture
def world(folder: Path) -> Iterator[World]:
    poses = [(0.0, 0.0, 1.0), (0.2, 0.0, 2.0), (0.4, 0.0, 3.0)]
    with World(program=folder / "talker.c", count=3, poses=poses, arena=(2.0, 1.0)) as world:
        yield world


def test_robots_can_be_looked_at(world: World) -> None:
    world.run(1)
    assert world.size == 3
    assert world.time_s == pytest.approx(1, abs=0.07)
    assert world.motors.tolist() == [[65, 12]] * 3
    assert world.leds.tolist() == [RGB(1, 2, 3)] * 3
    assert world.states == ["RGB(1,2,3)"] * 3
    assert world.poses.shape == (3, 3)
    assert world.poses[2, 0] == pytest.approx(0.4, abs=0.02)
    assert world.stats["frames_sent"] == 0
    assert len(world.result_hash) == 16


def test_variables_are_read_by_name(world: World) -> None:
    world.run(0.2)
    everything = world.variable(1, "all")
    assert everything["low"] == -6
    assert everything["many"] == [[1 + 5 + 17 + 1 + 1 + 2, 2], [3, 500]]
    assert everything["real"] == 2.5
    assert everything["mood"] == 1
    assert everything["yes"] is True
    assert (everything["narrow"], everything["wide"]) == (5, 17)
    assert world.variable(1, "kilo_uid") == 2
    assert world.variable(1, "setup:steps") == 2
    assert world.variable(1, "loop:steps") == 7
    assert world.variable(1, "talker.c:heard") == 0


def test_a_variable_that_is_not_there_is_told(world: World) -> None:
    with pytest.raises(InputError, match=r"has no variable 'nothing'; it has: all, heard"):
        world.variable(0, "nothing")
    with pytest.raises(InputError, match=r"several variables 'steps'; name one of: .*setup:steps"):
        world.variable(0, "steps")
    with pytest.raises(InputError, match="there is no robot 3; the robots are 0 to 2"):
        world.variable(3, "heard")


def test_what_robots_print_is_kept(world: World) -> None:
    world.run(0.5)
    assert world.prints(2) == "uid 3\nhalf a line\n"
    assert {event["robot"] for event in world.events} == {0, 1, 2}


def test_messages_go_to_all_to_one_or_to_a_place(world: World) -> None:
    world.run(0.1)

    def heard() -> list[int]:
        world.run(0.1)
        return [world.variable(robot, "heard") for robot in range(3)]

    world.send([0, 9], type=3)
    assert heard() == [9, 9, 9]
    assert world.variable(0, "heard_type") == 3
    world.send([0, 8], robot=1)
    assert heard() == [9, 8, 9]
    world.send([0, 7], within=(0.4, 0.0, 0.1))
    assert heard() == [9, 8, 7]


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ({"data": [0] * 10}, "data has 10 items; it must have at most 9"),
        ({"data": [256]}, "data.0 is 256; it must be from 0 up to 255"),
        ({"data": [1.5]}, "data.0 is 1.5; it must be a whole number, from 0 up to 255"),
        ({"data": 5}, "data is 5; it must be a list"),
        ({"type": 300}, "type is 300; it must be from 0 up to 255"),
        ({"within": (0, 0)}, "within has 2 items; it must have 3"),
        ({"within": (math.nan, 0, 1)}, "within.0 is nan; it must be a finite number"),
        ({"within": (0, 0, -1)}, "within is [0, 0, -1]; it must have a radius above 0"),
    ],
)
def test_a_message_that_cannot_be_is_refused(world: World, what: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"World: {said}")):
        world.send(**what)


@pytest.mark.parametrize(
    ("for_s", "said"),
    [
        (-1, "it must be from 0 up to 1000000000"),
        (math.nan, "it must be a finite number, from 0 up to 1000000000"),
        (math.inf, "it must be a finite number, from 0 up to 1000000000"),
        ("3", "it must be a number, from 0 up to 1000000000"),
        (True, "it must be a number, from 0 up to 1000000000"),
    ],
)
def test_time_that_cannot_pass_is_refused(world: World, for_s: Any, said: str) -> None:
    with pytest.raises(InputError, match=rf"^World: for_s is .*; {said}$"):
        world.run(for_s)
    assert world.tick == 0


@pytest.mark.parametrize("count", [-3, 1.5, True, "3", None])
def test_only_whole_ticks_go_by(world: World, count: Any) -> None:
    with pytest.raises(InputError, match=r"^World: count is .*; it must be .*from 0 up to"):
        world.run_ticks(count)
    assert world.tick == 0


def test_any_time_however_short_goes_on_by_a_step(world: World) -> None:
    world.run(0)
    assert world.tick == 0
    world.run(0.001)
    assert world.tick == 4


@pytest.mark.parametrize("robot", [3, -1, 1.0, True, "1", [0]])
def test_a_robot_that_is_not_there_is_told_by_all_who_take_one(world: World, robot: Any) -> None:
    calls: list[Callable[[], object]] = [
        lambda: world.variable(robot, "heard"),
        lambda: world.prints(robot),
        lambda: world.send(robot=robot),
        lambda: world.command("pause", robot=robot),
    ]
    number = type(robot) is int
    said = f"there is no robot {robot}; the robots are 0 to 2" if number else "robot is "
    for call in calls:
        with pytest.raises(InputError, match=f"^World: {said}"):
            call()


def test_numpys_numbers_are_numbers(folder: Path) -> None:
    poses = np.array([[0.0, 0.0, 1.0], [0.2, 0.0, 2.0]])
    size, seed = np.array([1.0, 1.0]), np.int64(3)
    with World(program=folder / "talker.c", poses=poses, arena=size, seed=seed) as world:
        world.run(np.float32(0.1))
        world.run_ticks(np.int32(4))
        world.send(np.arange(3), type=np.uint8(3), robot=np.int64(1))
        world.command("wakeup", robot=np.uint8(0))
        world.run(0.2)
        assert [world.variable(robot, "heard") for robot in np.arange(2)] == [0, 1]
        assert world.prints(np.int64(1)).startswith("uid 2")
        assert world.motors[0].tolist() == [0, 0]


@pytest.mark.parametrize("level", [4, -1, 1.0, "1"])
def test_a_colour_that_no_led_shows_is_refused(level: Any) -> None:
    with pytest.raises(InputError, match=r"^RGB: green is .* from 0 up to 3"):
        RGB(0, level, 0)


def test_commands_act_now(world: World) -> None:
    world.run(0.5)
    world.command("pause", robot=1)
    world.run(0.2)
    assert world.motors.tolist() == [[65, 12], [0, 0], [65, 12]]
    world.command("reset")
    world.run(0.2)
    assert world.motors.any() == 0
    assert world.variable(0, "all")["low"] == -5
    world.command("run")
    world.run(0.2)
    assert world.variable(0, "all")["low"] == -6


@pytest.mark.parametrize(
    ("send", "keys", "said"),
    [
        ("stop", {}, 'command.0.send is "stop"; '),
        ("run", {"robto": 1}, "unknown key 'robto' in [[command]]; did you mean 'robot'?"),
        ("run", {"robot": 9}, "there is no robot 9; the robots are 0 to 2"),
        ("run", {"at_s": 9}, "a command acts now, and once; remove 'at_s'"),
        ("run", {"repeat_s": 9}, "a command acts now, and once; remove 'repeat_s'"),
        ("readuid", {}, "'readuid' needs 'bit'; add bit = ..."),
    ],
)
def test_a_wrong_command_is_told(world: World, send: str, keys: dict[str, int], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        world.command(send, **keys)


def test_a_world_can_wait_for_its_run(folder: Path) -> None:
    with World(program=folder / "talker.c", count=1, command=[]) as world:
        world.run(1)
        assert world.prints(0) == ""
        world.command("run")
        world.run(0.1)
        assert world.prints(0) != ""


def test_a_world_can_be_made_of_a_file(folder: Path) -> None:
    settings = ["swarm.size=4", "states.blinking=white"]
    with World(folder / "small.toml", seed=3, set=settings) as world:
        world.run(0.75)
        assert world.states == ["blinking"] * 4


def test_a_plain_text_is_one_setting(folder: Path) -> None:
    with World(folder / "small.toml", set="swarm.size=4") as world:
        assert world.size == 4


def test_the_same_seed_gives_the_same_world(folder: Path) -> None:
    def result(seed: int, *steps: float) -> str:
        with World(program=folder / "talker.c", count=5, seed=seed) as world:
            for step in steps:
                world.run(step)
            return world.result_hash

    assert result(1, 4.0) == result(1, 1.048576, 4.0 - 1.048576)
    assert result(1, 4.0) != result(2, 4.0)


def test_several_programs_and_any_table_may_be_given(folder: Path) -> None:
    kinds = [{"program": folder / name, "count": 1} for name in ("talker.c", "blink.c")]
    light, medium = {"ambient": 7}, {"kind": "ideal"}
    with World(robots=kinds, arena=0.5, light=light, medium=medium) as world:
        world.run(0.2)
        assert world.leds.tolist() == [RGB(1, 2, 3), RGB(0, 0, 0)]


def test_variables_of_a_robot_with_an_atmega328p_are_not_read(folder: Path) -> None:
    with World(program=folder / "blink.c", cpu="avr") as world:
        world.run(0.5)
        with pytest.raises(InputError, match="robot 0 runs on its ATmega328P, whose variables"):
            world.variable(0, "count")


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"program": "nowhere.c"}, "World: program 'nowhere.c' is not there"),
        ({"program": "x.c", "cuont": 3}, "World: unknown key 'cuont'"),
        ({}, "[swarm] lacks 'program'"),
        ({"count": 3}, "World: these robots lack 'program', or 'hex'"),
        ({"robots": [], "count": 3}, "World: 'count' goes without robots="),
        ({"arena": (1, 2, 3)}, "World: arena is [1, 2, 3]; it must be (width, height) in metres"),
        ({"poses": 5}, "World: robots.0.poses is 5; it must be a list"),
        ({"swarm": 5}, "World: swarm is 5; it must be a table"),
        ({"set": [5]}, "World: set.0 is 5; it must be text"),
        ({"experiment": 5}, "World: experiment is 5; it must be text"),
    ],
)
def test_a_world_that_cannot_be_is_told(keys: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        World(**keys)  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "key"), [("blink.c", "program"), ("blink.hex", "hex")])
def test_a_program_given_as_the_experiment_is_told_how_to_type_it(name: str, key: str) -> None:
    for keys in [{}, {"count": 3}]:
        with pytest.raises(InputError, match="is a robot's program, not an") as refused:
            World(name, **keys)  # type: ignore[arg-type]
        assert str(refused.value).endswith(f'; type World({key}="{name}")')


def test_a_file_and_keys_do_not_go_together(folder: Path) -> None:
    with pytest.raises(InputError, match="'count' goes without a file"):
        World(folder / "small.toml", count=3)


def test_a_closed_world_says_so(folder: Path) -> None:
    world = World(program=folder / "blink.c", count=1)
    world.close()
    for ask in (lambda: world.run(1), lambda: world.poses, lambda: world.prints(0)):
        with pytest.raises(RunError, match="this world is closed"):
            ask()


DRIVER = """\
#include <kilolib.h>

static void setup(void) {}

static void loop(void) {
    spinup_motors();
    set_motors(kilo_straight_left, kilo_straight_right);
    delay(100);
}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
"""


def test_more_than_128_open_worlds_have_robots_that_touch(tmp_path: Path) -> None:
    (tmp_path / "driver.c").write_text(DRIVER)
    # Three abreast that drive into one that drives against them: an island.
    poses = [(0.0, -0.034, 0.0), (0.0, 0.0, 0.0), (0.0, 0.034, 0.0), (0.034, 0.01, math.pi)]
    keys: dict[str, Any] = {"program": str(tmp_path / "driver.c"), "poses": poses, "seed": 1}
    worlds = [World(**keys, count=4) for _ in range(130)]
    try:
        for world in worlds:
            world.run(2)
        assert len({world.result_hash for world in worlds}) == 1
    finally:
        for world in worlds:
            world.close()


def test_128_open_worlds_have_objects_and_the_next_says_so() -> None:
    transport = ROOT / "experiments" / "objects" / "transport.toml"
    worlds = [World(transport) for _ in range(128)]
    try:
        with pytest.raises(InputError, match=r"128 open worlds .* close worlds"):
            World(transport)
        worlds[0].close()
        World(transport).close()
    finally:
        for world in worlds:
            world.close()


def test_the_documents_test_passes(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "python_api.md").read_text()
    for language, name in (("python", "test_blink.py"), ("c", "blink.c")):
        found = re.search(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
        assert found
        (tmp_path / name).write_text(found[1])
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_blink.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout
    assert len((tmp_path / "test_blink.py").read_text().splitlines()) <= 12


def test_files_are_found_beside_the_python_file_that_names_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = tmp_path / "lab"
    (lab / "poses").mkdir(parents=True)
    (lab / "idle.c").write_text(
        "#include <kilolib.h>\nvoid setup(void) {}\nvoid loop(void) {}\n"
        "int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }\n"
    )
    (lab / "start.csv").write_text("x_m,y_m,heading_rad\n0,0,0\n0.1,0,0\n")
    (lab / "idle.toml").write_text(
        'duration_s = 1\n[arena]\ndiameter_m = 1\n[swarm]\nprofile = "kilobot"\n'
        'program = "idle.c"\nsize = 3\n'
    )
    code = (
        "from kilotwin import World\n"
        'with World(program="idle.c", poses="start.csv") as world: found = [len(world.poses)]\n'
        'with World("idle.toml") as world: found.append(len(world.poses))\n'
    )
    (lab / "asks.py").write_text(code)
    monkeypatch.chdir(tmp_path)
    assert runpy.run_path(str(lab / "asks.py"))["found"] == [2, 3]
