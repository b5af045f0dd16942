"""Programs of guests_avr check themselves; here each is built and runs, twice in one world."""

import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from kilotwin import World
from kilotwin.experiment.programs import find_program
from kilotwin.programs.native.guest import build

GUESTS = sorted((Path(__file__).parents[2] / "guests_avr").glob("*.c"))
STOPS = "assert_stops_the_robot"
NAMES = [guest.stem for guest in GUESTS]


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    """Two robots of each program, after the 15 s that the slowest check takes."""
    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda guest: build(find_program(str(guest), Path.cwd())), GUESTS))
    kinds = [{"program": guest, "count": 2, "cpu": "native"} for guest in GUESTS]
    with World(robots=kinds, arena=(3.0, 3.0)) as world:
        world.run(15)
        yield world


@pytest.mark.parametrize("name", [name for name in NAMES if name != STOPS])
def test_a_program_that_checks_itself_passes(world: World, name: str) -> None:
    for robot in (2 * NAMES.index(name), 2 * NAMES.index(name) + 1):
        said = world.prints(robot)
        assert "FAIL" not in said
        assert "passed\n" in said
        assert [event for event in world.events if event["robot"] == robot and failed(event)] == []


@pytest.mark.parametrize("name", ["flash_data_reads", "flash_tables_have_a_sign"])
def test_flash_reads_the_same_on_an_atmega328p(name: str) -> None:
    """And from what the other compiler makes of it."""
    (program,) = [guest for guest in GUESTS if guest.stem == name]
    with pytest.MonkeyPatch.context() as patch:
        if shutil.which("clang"):
            patch.setenv("KILOTWIN_CC", "clang")
        kinds = [{"program": program, "count": 1, "cpu": cpu} for cpu in ("native", "avr")]
        with World(robots=kinds) as world:
            world.run(15)
            assert [world.prints(robot).splitlines()[-1] for robot in (0, 1)] == ["passed"] * 2
            assert "FAIL" not in world.prints(0) + world.prints(1)


def test_an_assert_that_does_not_hold_stops_the_robot(world: World) -> None:
    robot = 2 * NAMES.index(STOPS)
    assert world.prints(robot) == "before\n"
    crash = next(event for event in world.events if event["robot"] == robot and failed(event))
    assert crash["kind"] == "crash"
    line = (
        GUESTS[robot // 2].read_text().splitlines().index("    assert(kilo_ticks == UINT32_MAX);")
    )
    where = f"{STOPS}.c:{line + 1} in check()"
    assert crash["text"] == f"at {where}: assert failed: kilo_ticks == UINT32_MAX"


def test_a_programs_own_interrupt_handlers_are_noted(world: World) -> None:
    robot = 2 * NAMES.index("interrupts_wait_while_off")
    notes = [event for event in world.events if event["kind"] == "note"]
    assert [(note["robot"], note["text"]) for note in notes] == [
        (robot, "its own interrupt handlers are never called here: TIMER1_OVF_vect")
    ]


def failed(event: object) -> bool:
    assert isinstance(event, dict)
    return event["kind"] in ("crash", "endless", "stack_overflow")
