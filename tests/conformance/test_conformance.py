"""A program decides the same on this computer and on the ATmega328P, at the same ticks.

Both get the same messages, distances, light and random bytes (emulator/avr/differential_test.h).
Decisions are LED, motors and messages sent; values, order and ticks have to be equal. What may
differ:

- the moment within a tick, for on the robot instructions and interrupts take time. That is why
  inputs keep away from the moments at which a microsecond more decides: a message ends in the
  middle of a tick, and begins when the robot does not send;
- what stands for less than half a millisecond: two registers are written one after the other;
- programs whose result depends on 16-bit int, 32-bit double, delay() (which interrupts prolong), or
  on an interrupt between two lines of loop(). None of ours does.
"""

import random
from pathlib import Path
from typing import Any

import pytest

from kilotwin._emulator import CONFIG_KEYS, DifferentialTest, config_message
from kilotwin.experiment.programs import find_program
from kilotwin.programs.image import image as avr_build
from kilotwin.programs.native import guest as guest_build

ROOT = Path(__file__).resolve().parents[2]
OWN = Path(__file__).parent / "programs"
# The robot with uid 1 has a role of its own in two of them.
EXAMPLES = [("gradient", 1), ("orbit", 1)]
EXAMPLES += [(path.stem, 7) for path in sorted((ROOT / "firmware/examples").glob("*.c"))]

# A step is a tick: loop() may decide in each.
SHORT_STEPS = 4_000
LONG_STEPS = 1_000_000
LONG_SHARE = 50_000  # with one seed and one set of parameters

# Parameters of the controllers: much happens in little time.
RANGES = {
    "ALPHA": (0, 65536),
    "BETA": (0, 200_000),
    "FIRAT_A": (0, 300_000),
    "FIRAT_K": (0, 2_000_000),
    "UPDATE_TICKS": (5, 100),
    "STRAIGHT_TICKS": (5, 80),
    "ENTRY_TICKS": (0, 60),
    "RHO": (0, 65535),
    "TURN_TICKS_PER_RAD": (100_000, 3_000_000),
    "WINDOW_TICKS": (5, 100),
    "TIMEOUT_TICKS": (5, 100),
    "CAPACITY": (1, 100),
    "EMPTY_WINDOWS": (1, 4),
    "INFORMED_SITE": (0, 3),
    "WALL_IGNORE_TICKS": (0, 100),
    "TRACKING_TICKS": (0, 100),
}


def both_tiers(path: Path, **settings: Any) -> DifferentialTest:
    """A program on both tiers, built as `kilotwin run` builds it."""
    program = find_program([str(path)], ROOT, [], [])
    guest, image = guest_build.build(program), avr_build.build_image(program)
    exactly: Any = {"uid": 7, "before_run": [], "slack_s": 0, "waits": False, "follow": None}
    return DifferentialTest(
        guest=str(guest.file),
        tier="native",
        elf=str(image.elf),
        name=guest.name,
        **{**exactly, **settings},
    )


def controller(rule: int, seed: int) -> list[bytes]:
    """CONFIG messages with which a robot is this controller, all else by chance."""
    dice = random.Random(seed)
    chosen = {
        name: RANGES.get(name, (least, most))
        for name, (_, _, least, most) in CONFIG_KEYS.items()
        if name in RANGES or most <= 2
    }
    values = {name: dice.randint(*limits) for name, limits in chosen.items()} | {"RULE": rule}
    return [config_message(0, 65535, CONFIG_KEYS[name][0], v) for name, v in values.items()]


def assert_no_difference(test: DifferentialTest, steps: int) -> None:
    test.run(steps)
    assert test.difference is None
    assert (test.avr_failure, test.native_failure) == ("", "")
    assert test.tick == steps + 1
    assert test.ticks_apart == 0
    assert test.worst_lag_s < 0.005  # within the tick: a message of its own comes before
    assert test.received > steps / 10
    assert test.compared > steps / 200


def sizes(long_steps: int) -> pytest.MarkDecorator:
    """Steps in all, and with one seed."""
    short = pytest.param(SHORT_STEPS, SHORT_STEPS, id="short")
    long = pytest.param(long_steps, LONG_SHARE, id="long", marks=pytest.mark.long)
    return pytest.mark.parametrize(("steps", "share"), [short, long])


@sizes(LONG_STEPS)
@pytest.mark.parametrize("rule", [0, 1], ids=["simplified", "firat"])
def test_a_controller_decides_the_same(rule: int, steps: int, share: int) -> None:
    for seed in range(steps // share):
        before = controller(rule, seed)
        test = both_tiers(ROOT / "firmware/aggregation", seed=seed, before_run=before)
        assert_no_difference(test, share)


@sizes(LONG_STEPS // 5)
@pytest.mark.parametrize(("example", "uid"), EXAMPLES, ids=str)
def test_an_example_decides_the_same(example: str, uid: int, steps: int, share: int) -> None:
    path = ROOT / "firmware/examples" / f"{example}.c"
    for seed in range(steps // share):
        assert_no_difference(both_tiers(path, seed=seed, uid=uid), share)


@pytest.mark.parametrize("example", ["talk_and_listen", "blink"])
def test_a_robot_answers_for_its_vitals_in_the_same_tick(example: str) -> None:
    """Beside the program's own messages, and by a program that sends none."""
    path, steps, every = ROOT / "firmware/examples" / f"{example}.c", 800, 20
    asked, left_alone = (both_tiers(path, seed=1, follow=[], ask_every=n) for n in (every, 0))
    assert_no_difference(asked, steps)
    left_alone.run(steps)
    assert asked.compared >= left_alone.compared + steps // every * 0.8


@pytest.mark.parametrize(
    ("name", "differs_in"), [("int_overflows", "led"), ("double_is_short", "led"), ("waits", "led")]
)
def test_a_program_that_depends_on_the_machine_is_told_from_others(
    name: str, differs_in: str
) -> None:
    test = both_tiers(OWN / f"{name}.c", seed=1)
    test.run(2000)
    assert test.difference is not None
    assert test.difference["kind"] == differs_in


def test_how_far_both_run_at_once_changes_nothing() -> None:
    def lived(step: int) -> tuple[int, int, float]:
        test = both_tiers(ROOT / "firmware/examples/orbit.c", seed=3)
        for _ in range(600 // step):
            test.run(step)
        return test.received, test.compared, test.worst_lag_s

    assert lived(600) == lived(1)
