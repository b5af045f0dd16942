"""A swarm: over the air, from an overhead controller and through a Kilogrid."""

from collections.abc import Callable
from typing import Any

import pytest

from .conftest import Person, Typed, Words

BLINK, ORBIT = "firmware/examples/blink.c", "firmware/examples/orbit.c"
PAPER, PAPER_MODULES = "experiments/kilogrid/paper-n50.toml", 200
Told = Callable[..., Any]


def test_21_robots_are_flashed_by_an_overhead_controller(
    told: Told, ohc: Words, person: Person
) -> None:
    """Original boot loaders take a program from us by an original overhead controller."""
    person("robots with the ORIGINAL boot loader lie below the controller, awake; ready?")
    sent = told("flash", "robots", BLINK, *ohc, "--run")
    assert sent["verified"] is None, "they cannot answer, so nothing may be called verified"
    person("do all of them blink red, half a second on and half a second off?")


def test_22_robots_of_ours_are_flashed_by_an_overhead_controller(
    told: Told, ohc: Words, person: Person
) -> None:
    """Our boot loader takes a program from an original overhead controller."""
    person("robots with KILOTWIN'S boot loader lie below the controller, awake; ready?")
    told("flash", "robots", BLINK, *ohc, "--run")
    person("do all of them blink red, half a second on and half a second off?")


def test_23_robots_are_flashed_through_a_grid_and_each_is_verified(
    told: Told, can: Words, robots: int
) -> None:
    """Our boot loaders of robots and modules pass pages, questions and answers on."""
    done = told("flash", "robots", BLINK, "--via", "grid", *can, "--count", str(robots), "--run")
    assert len(done["verified"]) == robots
    assert done["failed"] == []


def test_24_a_robot_that_is_switched_off_in_between_is_not_stuck(
    told: Told, can: Words, robots: int, person: Person
) -> None:
    """A power cut in mid-flash leaves a robot in its loader, and it is flashed the next time."""
    person("when pages are sent, switch one robot off and on again; ready?")
    told("flash", "robots", ORBIT, "--via", "grid", *can)
    done = told("flash", "robots", ORBIT, "--via", "grid", *can, "--count", str(robots), "--run")
    assert len(done["verified"]) == robots
    person("do all robots shine as stars or planets of orbit.c do?")


def test_25_robots_tell_uid_and_voltage_through_a_grid(told: Told, can: Words, robots: int) -> None:
    """Robots with our runtime answer through cells, each with a uid of its own."""
    answers = told("robots", "voltage", "--via", "grid", *can)
    assert len({answer["uid"] for answer in answers}) == robots


def test_26_robots_sleep_and_wake_up(kilotwin: Typed, can: Words, person: Person) -> None:
    """Robots go to sleep by one order, and all are awake within 50 s of the other."""
    kilotwin("robots", "sleep", "--via", "grid", *can)
    person("are all robots dark, but for a white flash now and then?")
    kilotwin("robots", "wakeup", "--via", "grid", *can)
    person("do all robots blink again?")


def test_27_an_experiment_is_recorded(
    told: Told, can: Words, robots: int, modules: int, tmp_path: Any
) -> None:
    """On a table of 10 x 20 modules robots, cells and host play together in an experiment."""
    if modules != PAPER_MODULES:
        pytest.skip("needs --size 10x20")
    told("flash", "robots", "firmware/aggregation", "--via", "grid", *can, "--count", str(robots))
    buses = [word for word in can if word != "--size"][: 2 * can.count("--can")]
    settings = ["--set", "duration_s=120", "--set", f"swarm.size={robots}"]
    summary = told("record", PAPER, *buses, *settings, "--out", str(tmp_path / "run"))
    assert summary["grid"]["reports"] >= robots
